"""Draw pictures: of pixels for files and reports, of characters for the terminal."""
