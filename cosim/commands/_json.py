"""The option that every verb with an answer has."""

from typing import Annotated

from cyclopts import Parameter

Json = Annotated[bool, Parameter("--json", negative=(), show_default=False, help="Answer in JSON.")]
