"""List the results of the paper (section VI, appendices A.1 to A.3), in percent, on its own objects and scenes.

Structures are in the order circle, tower, line, table setting; failures in the order intersection, abnormal velocity,
not upright, semantic. It has about 101 scenes per structure: the 95 % interval of a success rate is about 9 points wide
to each side.
"""

STRUCTURES = ("circle", "tower", "line", "table setting")
LANGUAGE = {False: (65, 72, 72, 66), True: (63, 70, 67, 67)}  # by whether the sentence is embedded as one
GUIDANCE = {  # by weight
    0.0: (65, 72, 72, 66),
    1.0: (60, 76, 73, 70),
    2.0: (58, 74, 69, 73),
    4.0: (58, 78, 73, 66),
    8.0: (61, 73, 69, 70),
}
FAILURES_OF_METHODS = {
    "StructDiffusion without collision discriminator": (17.33, 14.36, 5.20, 5.94),
    "StructDiffusion": (6.44, 17.57, 4.46, 3.71),
    "CVAE": (28.71, 14.11, 5.20, 5.69),
    "CVAE with collision discriminator": (20.05, 12.62, 3.22, 3.47),
    "optimisation with CVAE prior": (17.33, 13.12, 5.69, 6.93),
}
FAILURES_OF_STRUCTURES = {
    "circle": (4.95, 24.75, 4.95, 0.00),
    "tower": (12.87, 8.91, 4.95, 8.91),
    "line": (5.94, 17.82, 4.95, 0.00),
    "table setting": (1.98, 18.81, 2.97, 5.94),
}
