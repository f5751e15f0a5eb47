"""Write what the kinds of static map say into the JSON Schema of exported models.

Run: python tools/model_schema.py
"""

import json
from pathlib import Path

from hwid_cli.export.map_parts import extrapolation_schema, map_schema

SCHEMA = Path(__file__).parents[1] / "hwid_cli" / "export" / "model.schema.json"


def main() -> None:
    """Replace the part about maps."""
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    schema["$defs"]["map"] = map_schema()
    schema["$defs"]["extrapolation"] = extrapolation_schema()
    SCHEMA.write_text(f"{json.dumps(schema, indent=1)}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
