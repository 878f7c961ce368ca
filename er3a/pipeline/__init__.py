"""From a study file to results, recordings and pages."""
