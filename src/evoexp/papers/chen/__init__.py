"""Chen & Zalzala 1995: paths and docking configurations of a mobile manipulator."""
