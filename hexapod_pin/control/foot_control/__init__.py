"""Foot control after S1: slip correction, virtual suspension, and what a robot needs beside them."""
