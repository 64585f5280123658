# SPDX-License-Identifier: Apache-2.0
"""python3 -m brainshift.cohort: the same as brainshift-bids."""
from .command import main

raise SystemExit(main())
