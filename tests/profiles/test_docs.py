"""The table of all settings in docs/profiles.md is what the schema says."""

from pathlib import Path

from profiles import Profile, load

DOCS = Path(__file__).parents[2] / "docs" / "profiles.md"
BEGIN, END = "<!-- settings begin -->\n", "<!-- settings end -->\n"


def ranges(part):
    """What a setting may be, from its JSON Schema."""
    if "anyOf" in part:
        return " or ".join(ranges(one) for one in part["anyOf"])
    if "enum" in part:
        return ", ".join(f'`"{one}"`' for one in part["enum"])
    if part.get("type") == "array":
        items = part.get("prefixItems")
        if items:
            alike = {ranges(one) for one in items}
            return f"{len(items)} numbers, {' / '.join(sorted(alike))}"
        return "list of text"
    if "minimum" in part or "exclusiveMinimum" in part:
        low = f"{part['minimum']:g}" if "minimum" in part else f"above {part['exclusiveMinimum']:g}"
        return f"{low} to {part['maximum']:g}"
    return {"string": "text", "boolean": "true or false", "null": "none", "integer": "whole number"}.get(
        part.get("type"), "number"
    )


def written(value):
    """A default as TOML writes it."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return "[" + ", ".join(written(one) for one in value) + "]" if len(str(value)) < 40 else "see `show`"
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"


def resolved(schema, part):
    """A part of a schema without references."""
    if "$ref" in part:
        return resolved(schema, schema["$defs"][part["$ref"].rsplit("/", 1)[1]])
    return {
        key: [resolved(schema, one) for one in value] if key in ("anyOf", "prefixItems") else value
        for key, value in part.items()
    }


def table():
    """All sections with their settings, in Markdown."""
    schema = Profile.model_json_schema()
    lines = []
    for name, section in schema["properties"].items():
        properties = resolved(schema, section).get("properties")
        if properties is None:
            continue
        lines += [f"### [{name}]\n", "| setting | default | may be | what it is |", "|---|---|---|---|"]
        for setting, part in properties.items():
            part = resolved(schema, part)
            lines.append(
                f"| `{setting}` | {written(part.get('default'))} | {ranges(part)} | {part['description']} |"
            )
        lines.append("")
    return "\n".join(lines)


def test_the_table_of_settings_is_that_of_the_schema(request):
    text = DOCS.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    shown, _, after = rest.partition(END)
    if request.config.getoption("--regenerate-golden"):
        DOCS.write_text(before + BEGIN + table() + END + after, encoding="utf-8")
        return
    assert shown == table()


def test_the_defaults_are_those_of_marlin_generic_but_for_what_is_said():
    text = " ".join(DOCS.read_text(encoding="utf-8").split())
    assert (
        "those of `marlin-generic`, but without its prime line (`prime_mm`), its joins (`join_spacings`)"
        in text
    )
    default, generic = Profile(), load("marlin-generic")
    differing = {
        key
        for section, values in default
        for key, value in values
        if value != getattr(getattr(generic, section), key)
    }
    body = {
        "name",
        "tip_width_mm",
        "cone_deg",
        "cone_mm",
        "length_mm",
        "barrel_width_mm",
        "shoulder_width_mm",
    }
    assert differing - {"description"} == {"prime_mm", "park_mm", "join_spacings"} | body
