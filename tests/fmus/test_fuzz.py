"""A share of the fuzzer: any calls, with sanitizers, on models that use the whole runtime."""

import pytest
from fuzzing import fuzz, program


@pytest.mark.parametrize(
    "name",
    [pytest.param("pendulum", marks=pytest.mark.slow), "hybrid", pytest.param("controller", marks=pytest.mark.slow)],
)
def test_any_calls_keep_the_laws(models, tmp_path, name):
    tally = fuzz([program(models[name](), tmp_path / "model")], 1, 300, 120)
    assert tally.faults == ()
    assert tally.sequences == 300
    assert tally.calls > 3000


@pytest.mark.slow
def test_a_broken_law_is_found(models, tmp_path):
    """A runtime in which all bytes are alike: the fuzzer says that damaged states pass, and with which seed."""
    seeded = tmp_path / "seeded.h"
    seeded.write_text(
        "#include <string.h>\n"
        "static inline int alike(const void* a, const void* b, size_t n) { return a && b && n ? 0 : 0; }\n"
        "#define memcmp alike\n"
    )
    file = program(models["controller"](), tmp_path / "model", ("-include", str(seeded)))
    faults = fuzz([file], 1, 200, 120).faults
    assert any("damaged bytes of a state are refused" in fault for fault in faults)
