"""The compiled module as it is installed."""

import shutil
import subprocess
import sys

import pytest

from linkwork import _linkwork

NAMES = """sin cos sincos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 exp10 expm1 log log2 log10 log1p
pow cbrt hypot tgamma lgamma lgamma_r erf erfc""".split()


@pytest.mark.skipif(sys.platform != "linux", reason="other systems use the functions of their C library")
def test_the_module_takes_no_mathematical_function_of_the_c_library():
    nm = shutil.which("nm")
    assert nm, "there is no `nm`"
    text = subprocess.run([nm, "-D", "--undefined-only", _linkwork.__file__], capture_output=True, text=True, check=True).stdout
    taken = {line.split()[-1].split("@")[0] for line in text.splitlines() if line.split()}
    assert "malloc" in taken
    assert not taken & set(NAMES)
