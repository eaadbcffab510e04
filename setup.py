"""Adds what pyproject.toml cannot say: configs/ ships inside the wheel as the package pipeline.configs."""

from setuptools import find_packages, setup

setup(
    packages=[*find_packages(include=["pipeline", "pipeline.*"]), "pipeline.configs"],
    package_dir={"pipeline.configs": "configs"},
    package_data={
        "pipeline.configs": ["*.toml", "colonization/*.toml", "organic/*.toml", "species/*.toml"],
        "pipeline": ["py.typed"],
        "pipeline.cityjson": ["*.json"],
    },
)
