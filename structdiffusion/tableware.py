"""Nouns whose meaning a table setting depends on."""

# Things with a front: it points away from the diner.
CUTLERY = ("fork", "knife", "spoon")
# What can be the base of a setting, and the drinkware in it.
BASES = ("plate", "bowl")
DRINKWARE = ("cup", "mug")
