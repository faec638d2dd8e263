"""Result files with bytes, dimensions, types, attributes or values changed, through all
that read them.
"""

import importlib.util
import tempfile
from functools import cache
from pathlib import Path
from unittest import mock

import netCDF4
import numpy as np
from siege import ROOT, chosen, command, judged, outline, require

from wearsim.report import html
from wearsim.results import file as results_file

WAYS = (
    "bytes",
    "dimensions",
    "lengths",
    "types",
    "values",
    "attributes",
    "variables",
    "translation",
)
TRANSLATE, REPORT = ("translate", "rig.nc", "field.nc", "--json"), ("report", ".")


@cache
def valid_files():
    """Content of the results of a rig and a field campaign of three steps, and of their
    translation.
    """
    path = ROOT / "tests/translation/synthetic_campaign.py"
    spec = importlib.util.spec_from_file_location("made_up_campaign", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for kind in ("rig", "field"):
            module.write_campaign(folder / f"{kind}.nc", kind, 3, 10e-9)
        words = (
            "translate",
            folder / "rig.nc",
            folder / "field.nc",
            "--out",
            folder / "translation.nc",
        )
        code, _, printed = command(*words)
        require(code == 0, printed)
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def rewritten(path, *, dimensions=None, kinds=None, sizes=None, without=()):
    """Write a file anew with some variables or lengths of dimensions changed."""
    old = path.rename(path.with_name("old.nc"))
    with (
        netCDF4.Dataset(old) as given,
        netCDF4.Dataset(path, "w", diskless=True, persist=True) as made,
    ):
        given.set_auto_maskandscale(False)
        for name, dimension in given.dimensions.items():
            made.createDimension(name, (sizes or {}).get(name, len(dimension)))
        made.setncatts({key: given.getncattr(key) for key in given.ncattrs()})
        for name, variable in given.variables.items():
            if name in without:
                continue
            attributes = {key: variable.getncattr(key) for key in variable.ncattrs()}
            fill = attributes.pop("_FillValue", None)
            axes = (dimensions or {}).get(name, variable.dimensions)
            kind = (kinds or {}).get(name, variable.dtype)
            copy = made.createVariable(
                name, kind, axes, fill_value=fill if kind == variable.dtype else None
            )
            copy.setncatts(attributes)
            copy.set_auto_maskandscale(False)
            if kind == variable.dtype and axes == variable.dimensions and not sizes:
                copy[:] = variable[:]
    old.unlink()


def damage_bytes(path, random):
    """4 kB of zeros anywhere, as after a power failure, some wrong bytes, or the end
    missing.
    """
    content = bytearray(path.read_bytes())
    place = int(random.integers(len(content)))
    how = chosen(random, ("zeros", "wrong", "cut", "one"))
    if how == "zeros":
        content[place : place + 4096] = bytes(len(content[place : place + 4096]))
    elif how == "cut":
        del content[place:]
    for at in (
        random.integers(len(content), size={"wrong": 200, "one": 1}.get(how, 0))
        if content
        else ()
    ):
        content[at] = random.integers(256)
    path.write_bytes(content)


def change_values(array, random):
    """Another value at one place or everywhere: missing, without end, scaled, in
    another order.
    """
    if array.dtype.kind not in "fi":
        return array[::-1].copy()
    some = (
        slice(None)
        if random.random() < 0.5
        else int(random.integers(max(array.size, 1)))
    )
    flat = array.copy().ravel()
    how = chosen(
        random,
        (
            "nan",
            "inf",
            "fill",
            "scaled",
            "reversed",
            "zero",
            "negative",
            "tiny",
            "huge",
        ),
    )
    if how == "reversed":
        return array[::-1].copy() if array.ndim else array
    if array.dtype.kind == "i":
        huge = np.iinfo(array.dtype).max
        flat[some] = {"zero": 0, "negative": -1, "huge": huge}.get(
            how, int(random.integers(-5, 20))
        )
    elif how in ("scaled", "negative", "tiny", "huge"):
        scale = chosen(random, (1.1, 0.5, 1e3, 1e6))
        factors = {"scaled": scale, "negative": -1.0, "tiny": 1e-300, "huge": 1e300}
        with np.errstate(all="ignore"):
            flat[some] = flat[some] * factors[how]
    else:
        flat[some] = {
            "nan": np.nan,
            "inf": np.inf,
            "fill": netCDF4.default_fillvals["f8"],
            "zero": 0.0,
        }[how]
    return flat.reshape(array.shape)


ATTRIBUTES = (
    np.nan,
    np.inf,
    0.0,
    -1.0,
    1e300,
    "",
    "x",
    "µ" * 300,
    "9" * 400,
    np.arange(3.0),
    np.int32(7),
    "a\nb",
    "nan",
)


def change_attribute(path, random):
    """Another value of an attribute of the file or of a variable, or none."""
    with netCDF4.Dataset(path, "a") as file:
        holder = file if random.random() < 0.6 else file[chosen(random, file.variables)]
        names = [name for name in holder.ncattrs() if name != "_FillValue"]
        if not names:
            return
        name = chosen(random, names)
        if random.random() < 0.3:
            holder.delncattr(name)
        else:
            holder.setncattr(name, chosen(random, ATTRIBUTES))


def change(path, way, random):
    """Change one thing of a result file."""
    if way == "bytes":
        return damage_bytes(path, random)
    if way == "attributes":
        return change_attribute(path, random)
    with netCDF4.Dataset(path) as file:
        lengths = {name: len(dimension) for name, dimension in file.dimensions.items()}
        axes = {name: variable.dimensions for name, variable in file.variables.items()}
    name = chosen(random, axes)
    if way == "dimensions":
        others = tuple(chosen(random, lengths) for _ in range(random.integers(4)))
        return rewritten(
            path,
            dimensions={
                name: chosen(random, (axes[name][:-1], axes[name][::-1], others))
            },
        )
    if way == "lengths":
        size = chosen(random, lengths)
        return rewritten(
            path,
            sizes={size: chosen(random, (0, 1, lengths[size] + 1, 10**4, 5 * 10**8))},
        )
    if way == "types":
        return rewritten(
            path,
            kinds={
                name: chosen(random, (str, "f4", "f8", "i1", "i4", "i8", "u8", "S1"))
            },
        )
    if way == "values":
        with netCDF4.Dataset(path, "a") as file:
            file.set_auto_maskandscale(False)
            file[name][...] = change_values(np.asarray(file[name][...]), random)
        return None
    return rewritten(
        path, without=[chosen(random, axes) for _ in range(random.integers(1, 3))]
    )


def attack(way, random, folder):
    """Read one changed file in one of all ways."""
    name = (
        "translation.nc"
        if way == "translation"
        else chosen(random, ("rig.nc", "field.nc"))
    )
    for file in {"rig.nc", "field.nc", name}:
        (folder / file).write_bytes(valid_files()[file])
    change(
        folder / name,
        chosen(random, WAYS[:-1]) if way == "translation" else way,
        random,
    )
    # a report takes a second, nearly all for its figures: one in 20, its figures in
    # outline
    words = chosen(
        random, [("inspect", name, "--json")] * 13 + [TRANSLATE] * 6 + [REPORT]
    )
    with (
        mock.patch.multiple(results_file, RETRY_SECONDS=0.02),
        mock.patch.object(html, "to_svg", outline),
    ):
        code, out, printed = command(*words)
    require(
        (folder / "report.html").exists() == (words == REPORT and code == 0),
        "half a report",
    )
    return judged(code, out, printed, name, *(["."] if words == REPORT else []))
