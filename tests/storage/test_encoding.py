"""Objects: what is taken apart comes together again, and whatever a tree says, nothing is called or looked up."""

import functools
import math
from contextlib import suppress
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from sklearn.preprocessing import PolynomialFeatures, SplineTransformer

import unconstrain as uc
from unconstrain import storage
from unconstrain.errors import ArchiveError, UnconstrainError
from unconstrain.storage import classes
from unconstrain.storage.encoding import UntrustedError

POLICY = storage.Kind.POLICY


def there_and_back(value, trusted=()):
    return storage.decode(*storage.encode(value), trusted)


keys = st.none() | st.booleans() | st.integers(-(2**60), 2**60) | st.text(max_size=5)
plain = st.recursive(
    keys
    | st.floats()
    | st.builds(np.float64, st.floats())
    | st.builds(np.float32, st.floats(width=32))
    | st.builds(np.int64, st.integers(-(2**60), 2**60))
    | st.sampled_from([np.float64, np.int32, np.bool_, float, int, bool, str, np.dtype("f4")])
    | st.builds(slice, st.none() | st.integers(), st.none() | st.integers()),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.lists(inner, max_size=4).map(tuple)
        | st.dictionaries(keys, inner, max_size=4)
    ),
    max_leaves=20,
)


def same(a, b):
    if type(a) is not type(b):
        return False
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return same(list(a), list(b)) and same(list(a.values()), list(b.values()))
    if isinstance(a, float | np.floating):
        return a == b or (math.isnan(a) and math.isnan(b))
    return a == b


@settings(deadline=None)
@given(plain)
def test_plain_values_come_back_of_the_same_type(value):
    assert same(there_and_back(value), value)


def test_arrays_come_back_and_shared_ones_are_kept_once():
    array = np.arange(3.0)
    value = {"a": array, "b": [array, np.eye(2, dtype=np.float32).T], "c d/é": array + 1}
    tree, arrays = storage.encode(value)
    assert set(arrays) == {"a", "b.1", "c_d__"}
    back = storage.decode(tree, arrays)
    assert back["a"] is back["b"][0]
    np.testing.assert_array_equal(back["c d/é"], array + 1)


def test_arrays_of_objects_are_kept_element_by_element():
    value = np.empty(3, dtype=object)
    value[:] = ["x", np.arange(2), None]
    back = there_and_back(value)
    assert back.dtype == object
    assert back[0] == "x"
    np.testing.assert_array_equal(back[1], [0, 1])


def test_names_of_arrays_are_told_apart():
    _, arrays = storage.encode({"é": np.zeros(1), "è": np.ones(1)})
    assert set(arrays) == {"_", "_-2"}


def test_splines_and_generators_come_back():
    spline = BSpline(np.arange(8.0), np.eye(4), 3, extrapolate="periodic")
    back = there_and_back(spline)
    np.testing.assert_array_equal(back(np.linspace(3, 4, 5)), spline(np.linspace(3, 4, 5)))
    assert back.extrapolate == "periodic"
    for random in (np.random.RandomState(3), np.random.default_rng(3)):
        random.normal()
        assert there_and_back(random).normal() == random.normal()


class Own:
    def __init__(self, value):
        self.value = value

    def method(self, states):
        return states


def test_objects_of_ones_own_come_back_when_trusted():
    value = Own([Own(np.arange(3)), Own(None)])
    back = there_and_back(value, [Own])
    assert type(back.value[0]) is Own
    with pytest.raises(UntrustedError, match=f"{__name__}:Own"):
        there_and_back(value)
    with pytest.raises(UntrustedError):
        there_and_back([Own.method, there_and_back], [there_and_back])
    assert there_and_back(Own.method, [Own.method]) is Own.method
    assert storage.foreign_parts([value, there_and_back]) == [Own, there_and_back]


def cyclic():
    value = []
    value.append(value)
    return value


class Slotted:
    __slots__ = ("a",)


@pytest.mark.parametrize(
    "value",
    [
        3j,
        np.complex128(1),
        np.zeros(2, dtype=complex),
        np.zeros((2, 2), dtype=object),
        np.zeros(2, dtype="M8[s]"),
        np.zeros(2, dtype="f8,i4"),
        np.longdouble(1),
        {(1, 2): 3},
        {1, 2},
        b"bytes",
        "\ud800",
        1 << 2000,
        lambda states: states,
        functools.partial(there_and_back, 1),
        (i for i in range(3)),
        np.random.Generator(np.random.MT19937(0)),
        cyclic(),
        Slotted(),
        open,
        UnconstrainError("text"),
        memoryview(b"a"),
    ],
)
def test_what_cannot_be_saved_is_told_in_one_sentence(value, tmp_path):
    if value is open:  # a function like any other: saved by its name, not loaded
        with pytest.raises(UntrustedError):
            there_and_back(value)
        return
    with pytest.raises(UnconstrainError, match=r"^cannot save here") as caught:
        storage.save_object(tmp_path / "p.skops", POLICY, {"here": value})
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", classes.names())
def test_the_list_holds_classes_that_are_found_again_by_their_name(name):
    cls = classes.class_of(name)
    assert isinstance(cls, type)
    assert classes.name_of(cls) == name


HOSTILE = [
    # A number of folds that a list is made of when learning goes on.
    {"object": ["unconstrain.EpisodeFolds", {"n_folds": 10**12, "n_dealt": 0, "labels": [], "folds": {"array": "a"}}]},
    # What skops builds by calling or looking up, in our words and in its own.
    {"object": ["os.system", ["touch ran"]]},
    {"object": ["posix:system", ["touch ran"]]},
    {"object": ["subprocess:Popen", {"args": "touch ran"}]},
    {"object": ["builtins:eval", ["open('ran', 'w')"]]},
    {"object": ["unconstrain.os", {}]},
    {"object": ["unconstrain.atomic.os.system", {}]},
    {"object": ["unconstrain.", {}]},
    {"object": ["sklearn.utils", {}]},
    {"object": ["sklearn.__loader__", {}]},
    {"trusted": "posix:system"},
    {"trusted": "builtins:exec"},
    {"trusted": "sklearn.Pipeline"},
    {"trusted": ["posix:system"]},
    {"function": "os.system"},
    {"method": ["os", "system"]},
    {"partial": ["os.system", "touch ran"]},
    {"reduce": ["os.system", ["touch ran"]]},
    {"module": "os"},
    {"type": "object"},
    {"type": "os.system"},
    {"dtype": "O"},
    {"dtype": "f8,f8"},
    {"__reduce__": ["os.system", ["touch ran"]]},
    {"__class__": "Popen", "__module__": "subprocess", "__loader__": "ReduceNode", "content": []},
    {"object": ["sklearn.FunctionTransformer", {"func": {"trusted": "posix:system"}}]},
    {"object": ["sklearn.FunctionTransformer", {"__class__": {"type": "float64"}}]},
    {"object": ["sklearn.FunctionTransformer", {"__dict__": {"dict": []}}]},
    {"object": ["sklearn.FunctionTransformer", {"a.b": 1}]},
    {"object": ["sklearn.FunctionTransformer", None]},
    {"object": ["sklearn.FunctionTransformer", 3]},
    {"object": ["sklearn.FunctionTransformer", [1, 2]]},
    {"object": [{"object": ["sklearn.Pipeline", {}]}, {}]},
    {"object": "sklearn.Pipeline"},
    {"object": []},
    {"object": ["sklearn.Pipeline"]},
    # What readers of theirs would trip over.
    {"array": "missing"},
    {"array": ["a"]},
    {"array": {"array": "a"}},
    {"float": "1" * 1000},
    {"number": ["float64", "nan"]},
    {"number": ["int8", 1000]},
    {"number": ["float64", [1.0] * 10]},
    {"number": ["complex128", 1]},
    {"dict": [[{"tuple": []}]]},
    {"dict": [[[], 1]]},
    {"dict": 3},
    {"tuple": 3},
    {"slice": [1]},
    {"objects": 1000000000000},
    {"a": 1, "b": 2},
    {},
    {"spline": [None, None, 3, True, 0]},
    {"spline": [{"array": "a"}, {"array": "a"}, 10**9, True, 0]},
    {"spline": [{"array": "a"}, {"array": "a"}, -3, True, 0]},
    {"spline": [{"array": "a"}, {"array": "a"}, 3, True, 10**9]},
    {"random": ["MT19937", 3]},
    {"random": ["PCG64", {"dict": [["bit_generator", "PCG64"], ["state", 3]]}]},
    {
        "random": [
            "RandomState",
            {
                "dict": [
                    ["bit_generator", "MT19937"],
                    ["state", {"dict": [["key", {"array": "key"}], ["pos", 10**9]]}],
                    ["has_gauss", 0],
                    ["gauss", 0.0],
                ]
            },
        ]
    },
    functools.reduce(lambda inner, _: [inner], range(150), 0),
    functools.reduce(lambda inner, _: {"tuple": [inner]}, range(150), 0),
    # Objects whose methods would run out of memory or time.
    {
        "object": [
            "sklearn.PolynomialFeatures",
            {
                "degree": 3, "interaction_only": False, "include_bias": True, "order": "C", "n_features_in_": 3,
                "_min_degree": 0, "_max_degree": 10**9, "_n_out_full": 10**12, "n_output_features_": 10**12,
            },
        ]
    },
]  # fmt: skip


@pytest.mark.filterwarnings("ignore:Trying to unpickle")
@pytest.mark.parametrize("tree", HOSTILE, ids=range(len(HOSTILE)))
def test_hostile_trees_run_nothing_and_are_refused(tree, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arrays = {"a": np.arange(9.0), "key": np.zeros(624, dtype=np.uint32)}
    for value in (tree, hidden_in_a_policy(tree)):
        storage.write("hostile.skops", POLICY, {"works": True, "value": value}, arrays)
        with pytest.raises(ArchiveError) as caught:
            uc.load_policy("hostile.skops")
        assert "\n" not in str(caught.value)
        storage.write("hostile.skops", POLICY, {"works": False, "value": value}, arrays)
        with pytest.raises(ArchiveError):
            uc.load_policy("hostile.skops")
    assert [path.name for path in tmp_path.iterdir()] == ["hostile.skops"]


def hidden_in_a_policy(tree):
    X = np.random.default_rng(0).normal(size=(30, 2))
    whole, _ = storage.encode(uc.ParametricPolicy(PolynomialFeatures(2)).fit(X, X))
    inside(whole, "model_", "features")["transformer_"] = tree
    return whole


def inside(tree, *names):
    """The state of the object that lies at this path of attributes."""
    state = tree["object"][1]
    for name in names:
        state = state[name]["object"][1]
    return state


@pytest.mark.parametrize(
    ("attribute", "value"),
    [
        ("n_features_in_", 10**12),
        ("n_features_in_", "2"),
        ("n_features_in_", None),
        ("model_.n_actions", 10**9),
        ("model_.n_actions", 3),
        ("model_.features", []),
        ("model_.features", {"object": ["unconstrain.NormalizedRBF", {}]}),
        ("model_", None),
        ("solution_", {"object": ["unconstrain.GlobalModel", {}]}),
        ("solution_.w", None),
        ("solution_.w", 3),
        ("predict", None),
        ("score", 3),
        ("actions_are_scalars_", True),
        ("evaluate", "features_"),
    ],
)
def test_policies_with_another_state_are_damaged(attribute, value, tmp_path):
    X = np.random.default_rng(0).normal(size=(30, 2))
    tree, arrays = storage.encode(uc.ParametricPolicy(SplineTransformer()).fit(X, X))
    *path, last = attribute.split(".")
    inside(tree, *path)[last] = value
    storage.write(tmp_path / "p.skops", POLICY, {"works": True, "value": tree}, arrays)
    if attribute == "evaluate":  # an attribute that nothing asks for changes nothing
        assert uc.load_policy(tmp_path / "p.skops").predict(X).shape == X.shape
        return
    with pytest.raises(ArchiveError, match=r"is damaged .*save the policy again"):
        uc.load_policy(tmp_path / "p.skops")


@cache
def fitted_policies():
    X = np.random.default_rng(0).normal(size=(30, 2))
    policies = [
        uc.ParametricPolicy(SplineTransformer()),
        uc.ParametricPolicy(PolynomialFeatures(2)),
        uc.ParametricPolicy(uc.NormalizedRBF(4)),
        uc.LocallyLinearPolicy(n_centers=3),
        uc.ParametricPolicy(uc.DecoupledFeatures(4)),
    ]
    return [policy.fit(X, X) for policy in policies]


@settings(deadline=None, max_examples=200)
@given(st.data())
def test_states_changed_at_random_are_damaged_or_work(tmp_path_factory, data):
    tree, arrays = storage.encode(data.draw(st.sampled_from(fitted_policies())))
    node = tree
    while True:  # walk down at random, and change what is met
        inner = [(node, key) for key in (node if isinstance(node, dict) else range(len(node)))]
        container, key = data.draw(st.sampled_from(inner))
        node = container[key]
        if not isinstance(node, list | dict) or not node or data.draw(st.integers(0, 4)) == 0:
            break
    changes = [
        None,
        True,
        -1,
        0,
        10**9,
        10**30,
        0.5,
        "text",
        [],
        {},
        {"array": "solution_.w"},
        {"float": "nan"},
    ]
    container[key] = data.draw(st.sampled_from(changes))
    path = tmp_path_factory.mktemp("changed") / "p.skops"
    storage.write(path, POLICY, {"works": True, "value": tree}, arrays)
    with suppress(ArchiveError):
        assert uc.load_policy(path).predict(np.zeros((1, 2))).shape == (1, 2)


def test_a_file_that_skops_wrote_is_foreign(tmp_path):
    import zipfile

    with zipfile.ZipFile(tmp_path / "old.skops", "w") as old:
        old.writestr("schema.json", '{"__class__": "ParametricPolicy", "__loader__": "ObjectNode"}')
        old.writestr("unconstrain.json", '{"format": 1, "release": "0.1.0"}')
    with pytest.raises(ArchiveError, match="holds no policy saved by unconstrain"):
        uc.load_policy(tmp_path / "old.skops")
