"""Sentinels: what they look for in accepted steps stands in no residual."""
