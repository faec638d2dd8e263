"""Kernels of the strip model: linear systems, factorised once and solved as often as wanted."""

from __future__ import annotations

from wearsim.contact.kernel import kernel
from wearsim.contact.patch import FloatArray

_SMALL = 1e-13  # of a pivot, over its row's largest number before


@kernel
def factorise(matrix: FloatArray, n: int) -> bool:
    """Factorise in place into L and U, rows taking from those above four at a time; returns whether it went.

    Without pivoting: the strips' equations begin with a block of influences, and the rest follows from it.
    The reciprocals of U's diagonal are kept.
    """
    for i in range(n):
        line = matrix[i]
        size = 0.0
        for j in range(n):
            size = max(size, abs(line[j]))
        k = 0
        while k + 4 <= i:
            one, two, three, four = matrix[k], matrix[k + 1], matrix[k + 2], matrix[k + 3]
            a = line[k] * one[k]
            b = (line[k + 1] - a * one[k + 1]) * two[k + 1]
            c = (line[k + 2] - a * one[k + 2] - b * two[k + 2]) * three[k + 2]
            d = (line[k + 3] - a * one[k + 3] - b * two[k + 3] - c * three[k + 3]) * four[k + 3]
            line[k], line[k + 1], line[k + 2], line[k + 3] = a, b, c, d
            k += 4
            rest = line[k:n]
            first, second, third, fourth = one[k:n], two[k:n], three[k:n], four[k:n]
            for j in range(rest.size):  # of slices, from 0: only so are vector instructions used
                rest[j] = rest[j] - a * first[j] - b * second[j] - c * third[j] - d * fourth[j]
        while k < i:
            a = line[k] * matrix[k, k]
            line[k] = a
            rest, first = line[k + 1 : n], matrix[k, k + 1 : n]
            for j in range(rest.size):
                rest[j] -= a * first[j]
            k += 1
        if not abs(line[i]) > _SMALL * size:
            return False
        line[i] = 1.0 / line[i]
    return True


@kernel
def less_products(start: float, line: FloatArray, right: FloatArray, first: int, last: int) -> float:
    """Take the products of two rows from `first` up to `last` off a number, in four sums side by side."""
    a, b, c, d = start, 0.0, 0.0, 0.0
    k = first
    while k + 4 <= last:
        a -= line[k] * right[k]
        b -= line[k + 1] * right[k + 1]
        c -= line[k + 2] * right[k + 2]
        d -= line[k + 3] * right[k + 3]
        k += 4
    while k < last:
        a -= line[k] * right[k]
        k += 1
    rest: float = (a + b) + (c + d)
    return rest


@kernel
def substitute(matrix: FloatArray, right: FloatArray, n: int) -> None:
    """Solve in place with what `factorise` made."""
    for i in range(1, n):
        right[i] = less_products(right[i], matrix[i], right, 0, i)
    for i in range(n - 1, -1, -1):
        right[i] = less_products(right[i], matrix[i], right, i + 1, n) * matrix[i, i]
