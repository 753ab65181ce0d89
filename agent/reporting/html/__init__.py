"""Write the page of a run or session: one self-contained HTML file that loads nothing from elsewhere.

Its scripts play films and show the table in 3D; without them everything else is there, and a film's last picture.
"""
