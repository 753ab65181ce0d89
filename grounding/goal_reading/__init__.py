"""Read an instruction into a goal of several parts: its clauses, what each asks for, and which objects it means."""
