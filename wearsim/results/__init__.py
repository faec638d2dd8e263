"""Result file: its content, and how it is created, extended, verified and opened."""

from wearsim.results.checks import result_warnings
from wearsim.results.file import (
    append,
    attribute_of,
    create,
    load_results,
    loaded,
    open_results,
    open_whole,
    row_count,
    stored_rows,
    verify,
)
from wearsim.results.schema import (
    FILL_FLOAT,
    FILL_INT,
    GROUPS,
    LAYOUT,
    PATCH_SLOTS,
    ROW,
    Header,
    Row,
    check_row,
    layout_of,
)

__all__ = [
    "FILL_FLOAT",
    "FILL_INT",
    "GROUPS",
    "LAYOUT",
    "PATCH_SLOTS",
    "ROW",
    "Header",
    "Row",
    "append",
    "attribute_of",
    "check_row",
    "create",
    "layout_of",
    "load_results",
    "loaded",
    "open_results",
    "open_whole",
    "result_warnings",
    "row_count",
    "stored_rows",
    "verify",
]
