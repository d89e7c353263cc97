"""Hypothesis profiles: quick and repeatable for every day, long for `make verify`."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

settings.register_profile(
    "galley", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow], max_examples=50
)
settings.register_profile(
    "long", deadline=None, suppress_health_check=[HealthCheck.too_slow], max_examples=5000, print_blob=True
)
settings.load_profile("galley")
