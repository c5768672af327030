"""Two planners, one after the other (Chen & Zalzala 1995)."""
