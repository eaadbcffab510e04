#!/usr/bin/env python3
"""Make the known-truth trees in data/samples again; the same bytes every time."""

from __future__ import annotations

import sys
from pathlib import Path

from pipeline.synthetic.samples import write_samples

SAMPLES = Path(__file__).resolve().parent.parent / "data" / "samples"

if __name__ == "__main__":
    for path in write_samples(sys.argv[1] if len(sys.argv) > 1 else SAMPLES):
        print(f"{path}  {path.stat().st_size:,} bytes")
