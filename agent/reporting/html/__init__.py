"""Write the page of a run or session: one self-contained HTML file that loads nothing from elsewhere.

Its only script plays films; without it everything else is there, and a film's last picture.
"""
