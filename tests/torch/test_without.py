"""Where PyTorch is missing, a sentence says so, and everything else works."""

import subprocess
import sys

CODE = """
import sys
sys.modules["torch"] = None  # as if it were not installed
import unconstrain as uc
print(uc.torch.__name__)
try:
    uc.torch.inconsistency_loss([[1.0]], [[1.0]])
except uc.errors.UnconstrainError as error:
    print(error)
"""


def test_a_missing_extra_is_one_sentence():
    out = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True).stdout
    assert out.splitlines() == [
        "unconstrain.torch",
        "networks need PyTorch, which is not installed: pip install 'unconstrain[torch]'",
    ]
