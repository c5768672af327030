"""Collision of segments in the plane: arms of lines, arms with envelopes, arms among ellipses."""
