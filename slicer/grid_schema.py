"""What a grid file may hold, and one line of text for each thing that is wrong with one."""

import difflib
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from slicer.errors import GridError

RESOLUTION_MM = 0.001
LEAST_MM = 0.01
"""The least spacing and tile, ten times the resolution of positions: rounding moves a line by 5 % of it."""

MOST_MM = 10_000.0
REACH_MM = 100_000.0
"""How far from the origin a sheet and its outline may reach."""

Number = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-REACH_MM, le=REACH_MM)]
Size = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=LEAST_MM, le=MOST_MM)]
Angle = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Point = tuple[Number, Number]
Ring = Annotated[list[Point], Field(min_length=3)]
Polygon = Annotated[list[Ring], Field(min_length=1)]

_SIZE = {"type": "number", "minimum": LEAST_MM, "maximum": MOST_MM}
_NUMBER = {"type": "number", "minimum": -REACH_MM, "maximum": REACH_MM}
_POINT = {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2}
_POLYGON = {
    "type": "array",
    "items": {"type": "array", "items": _POINT, "minItems": 3},
    "minItems": 1,
}


def _both_sides(value: Any) -> Any:
    return [value, value] if isinstance(value, int | float) and not isinstance(value, bool) else value


def _several_polygons(value: Any) -> Any:
    """A single polygon, [ring, hole, ...], as the only one of several."""
    try:
        if isinstance(value[0][0], int | float):
            raise PydanticCustomError(
                "ring", "a ring must stand in a list, [[[x, y], ...]], and holes after it in the same list"
            )
    except (TypeError, IndexError, KeyError):
        pass  # the types are checked afterwards
    try:
        value[0][0][0][0]
    except (TypeError, IndexError, KeyError):
        return [value] if isinstance(value, list) else value
    return value


class GridFile(BaseModel):
    """A grid of fibre angles, as it stands in a file."""

    model_config = ConfigDict(extra="forbid", title="vslice grid")

    tile_mm: Annotated[
        tuple[Size, Size],
        BeforeValidator(_both_sides),
        WithJsonSchema({"anyOf": [_SIZE, {"type": "array", "items": _SIZE, "minItems": 2, "maxItems": 2}]}),
    ] = Field(description="Side of every tile in mm, or [width, height].")
    spacing_mm: Annotated[
        Annotated[Size, Tag("number")] | Annotated[list[list[Size | None]], Tag("grid")],
        Discriminator(lambda value: "grid" if isinstance(value, list) else "number"),
    ] = Field(description="Distance between neighbouring toolpaths in mm, or a grid of them, one a tile.")
    angles_deg: Annotated[list[Annotated[list[Angle | None], Field(min_length=1)]], Field(min_length=1)] = (
        Field(
            description="Tilt of each tile in degrees, counter-clockwise from +x, folded into (-90, 90]; "
            "row 0 is the bottom row; null is an empty tile."
        )
    )
    origin_mm: Point = Field((0.0, 0.0), description="x and y of the sheet's lower left corner in mm.")
    outline_mm: Annotated[
        list[Polygon] | None,
        BeforeValidator(_several_polygons),
        WithJsonSchema(
            {"anyOf": [_POLYGON, {"type": "array", "items": _POLYGON, "minItems": 1}, {"type": "null"}]}
        ),
    ] = Field(
        None,
        description="A polygon in mm that clips the sheet, [ring, hole, ...] as in GeoJSON, or several.",
    )
    min_length_mm: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=REACH_MM)] | None = (
        Field(None, description="Shorter toolpaths are dropped; by default the spacing.")
    )
    meta: Any = Field(default_factory=dict, description="Anything; kept as it is.")

    @model_validator(mode="after")
    def _same_shape(self) -> "GridFile":
        cols = len(self.angles_deg[0])
        for row, angles in enumerate(self.angles_deg):
            if len(angles) != cols:
                raise PydanticCustomError(
                    "ragged",
                    "angles_deg[{row}] has {found} tiles, but row 0 has {cols}; every row must have as many",
                    {"row": row, "found": len(angles), "cols": cols},
                )
        tiles = (cols, len(self.angles_deg))
        for number, side, start, name in zip(
            tiles, self.tile_mm, self.origin_mm, ("columns", "rows"), strict=True
        ):
            if start + number * side > REACH_MM:
                raise PydanticCustomError(
                    "reach",
                    "{number} {name} of {side} mm from {start} mm reach {end} mm, but {most} mm is the "
                    "farthest; split the sheet, or give tile_mm in mm",
                    {
                        "number": number,
                        "name": name,
                        "side": f"{side:g}",
                        "start": f"{start:g}",
                        "end": f"{start + number * side:g}",
                        "most": f"{REACH_MM:g}",
                    },
                )
        if isinstance(self.spacing_mm, list):
            rows = len(self.angles_deg)
            shape = [len(row) for row in self.spacing_mm]
            if len(shape) != rows:
                raise PydanticCustomError(
                    "shape",
                    "spacing_mm has {found} rows, but angles_deg has {rows}; give every tile its own",
                    {"found": len(shape), "rows": rows},
                )
            for row, found in enumerate(shape):
                if found != cols:
                    raise PydanticCustomError(
                        "shape",
                        "spacing_mm[{row}] has {found} numbers, but angles_deg[{row}] has {cols}",
                        {"row": row, "found": found, "cols": cols},
                    )
            for row in range(rows):
                for col in range(cols):
                    if self.spacing_mm[row][col] is None and self.angles_deg[row][col] is not None:
                        raise PydanticCustomError(
                            "spacing",
                            "spacing_mm[{row}][{col}] is null, but tile ({col}, {row}) has an angle; give it "
                            "a spacing above 0",
                            {"row": row, "col": col},
                        )
        return self


def parse(data: Any, source: str) -> GridFile:
    """Validate what a JSON file held.

    Raises:
        GridError: one line for each problem, with its place, what was found and what is allowed.
    """
    if not isinstance(data, dict):
        raise GridError(source, [f'holds {_name(data)}, but a grid is an object, {{"tile_mm": ...}}.'])
    try:
        return GridFile.model_validate(data)
    except ValidationError as error:
        problems = [_line(detail) for detail in error.errors(include_url=False)]
        raise GridError(source, list(dict.fromkeys(problems))) from None


def _line(detail: ErrorDetails) -> str:
    place = [step for step in detail["loc"] if isinstance(step, int) or step in GridFile.model_fields]
    kind, found, limits = detail["type"], detail["input"], detail.get("ctx", {})
    if kind == "extra_forbidden":
        key = str(detail["loc"][0])
        near = difflib.get_close_matches(key, GridFile.model_fields, n=1)
        hint = f"Did you mean '{near[0]}'?" if near else f"A grid has {', '.join(GridFile.model_fields)}."
        return f"unknown key '{key}'. {hint}"
    path = "".join(f"[{step}]" if isinstance(step, int) else str(step) for step in place)
    if kind == "missing":
        return f"{path}: is missing."
    if place and place[0] in ("angles_deg", "spacing_mm") and len(place) == 3:
        path = f"{path}: tile ({place[2]}, {place[1]})"
    if kind == "greater_than_equal":
        why = (
            f", ten times the {RESOLUTION_MM:g} mm to which positions are written"
            if place[0] == "spacing_mm"
            else ""
        )
        return f"{path}: {found:g} must be at least {limits['ge']:g} mm{why}."
    if kind == "less_than_equal":
        return f"{path}: {found:g} must be at most {limits['le']:g} mm."
    if kind == "finite_number":
        return f"{path}: {found} is no finite number."
    if kind in ("float_type", "float_parsing"):
        return f"{path}: {_name(found)} where a number is needed."
    if kind == "tuple_type" and path == "tile_mm":
        return f"{path}: {_name(found)} where a number or [width, height] is needed."
    if kind in ("list_type", "tuple_type", "dict_type"):
        wanted = "an object" if kind == "dict_type" else "a list"
        return f"{path}: {_name(found)} where {wanted} is needed."
    if kind in ("too_short", "too_long"):
        limit = limits.get("min_length", limits.get("max_length"))
        word = "at least" if kind == "too_short" else "at most"
        return f"{path}: has {limits['actual_length']} entries, but needs {word} {limit}."
    message = detail["msg"]
    return f"{path}: {message}." if path else f"{message}."


def _name(value: Any) -> str:
    """A value as a reader of JSON would call it, cut to a line."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f"the text {value[:30]!r}"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "an object"
    return f"{value!s:.30}"
