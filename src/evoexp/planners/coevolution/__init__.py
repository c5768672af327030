"""Co-evolving populations, one per robot (Curkovic, Jerbic & Stipancic 2013)."""
