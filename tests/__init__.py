"""Tests of treepipe; they mirror the package."""
