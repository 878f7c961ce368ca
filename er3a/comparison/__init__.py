"""Comparison of two tables: do they describe the same arm?"""
