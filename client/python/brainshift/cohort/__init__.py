# SPDX-License-Identifier: Apache-2.0
"""brainshift-bids: a cohort in BIDS, subject by subject and as a group (docs/cohort.md).

    layout       what a BIDS folder holds of a subject: image, brain, tumour, plan, recordings
    nifti        voxels and affine of a NIfTI-1 file, and masks written back
    case         the case file of a subject
    programs     brainshiftd and brainshift, as this package calls them
    files        files that appear whole or not at all, tables with their data dictionary, locks
    participant  one subject: prepare, play, score, report; goes on where it was cut off
    measures     what a surgery is judged by
    statistics   medians with intervals, Wilcoxon's signed rank test
    group        tables, statistics over subjects and report of a cohort
    compare      two versions or settings over one cohort
    command      the command line
"""
from .statistics import SignedRank, median_interval, signed_rank

__all__ = ["SignedRank", "median_interval", "signed_rank"]
