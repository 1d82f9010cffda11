"""The generated code is what the compiler makes of robot.proto today."""

import subprocess
import sys
from pathlib import Path

import covista_schemas

PACKAGE = Path(covista_schemas.__file__).parent


def test_the_generated_code_matches_the_proto(tmp_path: Path) -> None:
    out = [f"--python_out={tmp_path}", f"--pyi_out={tmp_path}"]
    command = [sys.executable, "-m", "grpc_tools.protoc", "-I.", *out, "covista_schemas/robot.proto"]
    subprocess.run(command, cwd=PACKAGE.parent, check=True)
    for name in ("robot_pb2.py", "robot_pb2.pyi"):
        assert (tmp_path / "covista_schemas" / name).read_text() == (PACKAGE / name).read_text(), (
            f"{name} is out of date"
        )
