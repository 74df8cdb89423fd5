"""The certificate: lower bounds of the clearance of every pair of bodies over a motion."""
