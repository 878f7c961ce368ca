"""From a study file to results, recordings and pages: everything that is no library."""
