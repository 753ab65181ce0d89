"""Convert words to structure specifications, the first step of instruction -> spec -> scene -> candidates -> plan
-> report.
"""
