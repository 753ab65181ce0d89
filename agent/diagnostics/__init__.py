"""`structagent doctor`: whether the installation works, and how to repair what does not."""
