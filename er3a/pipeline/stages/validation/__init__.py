"""Does the table match the reference data?"""
