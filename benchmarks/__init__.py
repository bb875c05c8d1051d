"""Ratios against named peers, each measured in the same run; nothing here is asserted."""
