"""Corrections: what a reply changes in the goal that was understood before."""
