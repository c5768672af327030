"""Curkovic, Jerbic & Stipancic 2013: co-evolution, methods I-VIII."""
