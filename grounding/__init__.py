"""Words to structure specifications: the first leg of instruction -> spec -> scene -> candidates -> plan -> report."""
