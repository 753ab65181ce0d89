"""Measure how often goals of several parts are met: `structagent evaluate goals`."""
