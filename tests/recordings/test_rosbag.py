"""ROS bags, written here by `rosbags` and read again; and a real one, where it is."""

import contextlib
import pickle
import shutil
import sqlite3
import sys
from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc
from tests.recordings.bags import Writing
from unconstrain.cli import main
from unconstrain.errors import DataError
from unconstrain.recordings.files import locate
from unconstrain.recordings.formats.rosbag import RosBag

NAV2 = Path(__file__).parents[3] / "shared" / "data" / "logs" / "nav2_turtlebot.mcap"

START = 1.7e9
KINDS = ("bag", "db3", "mcap")
XY = ["pose.position.x", "pose.position.y"]


def circle(t):
    return np.array([np.cos(t), np.sin(t), 0.0])


def files_of(path, kind):
    """The bag as a user may give it: the folder, and the file in it."""
    return [path] if kind == "bag" else [path, next(path.glob(f"*.{kind}"))]


def written(tmp_path, kind, fill, name="run"):
    path = tmp_path / (f"{name}.bag" if kind == "bag" else name)
    with Writing(path, kind) as bag:
        fill(bag)
    return path


def two_rates(bag):
    """A pose at 50 Hz and joints at 20 Hz, for two seconds."""
    for i in range(100):
        bag.stamped_pose("/pose", START + 0.02 * i, circle(0.02 * i))
    for i in range(41):
        bag.joints("/joints", START + 0.05 * i, ["elbow", "shoulder"], [0.05 * i, -0.1 * i])


@pytest.mark.parametrize("kind", KINDS)
def test_a_topic_is_differentiated_by_its_stamps_whatever_the_storage(tmp_path, kind):
    t = 0.02 * np.arange(100)
    path = written(tmp_path, kind, two_rates)
    for given in files_of(path, kind):
        demos = uc.load(given, state=XY, topic="/pose", window=0.06)
        assert demos.n_episodes == 1
        assert demos.state_names == tuple(XY)
        np.testing.assert_allclose(demos.states, np.column_stack([np.cos(t), np.sin(t)]))
        np.testing.assert_allclose(demos.time, t, atol=1e-9)
        tangent = np.column_stack([-np.sin(t), np.cos(t)])
        np.testing.assert_allclose(demos.actions[2:-2], tangent[2:-2], atol=1e-3)
        assert any("stamps in the messages (50 a second)" in note for note in demos.notes)


@pytest.mark.parametrize("kind", KINDS)
def test_custom_messages_are_read_by_the_definitions_in_the_bag(tmp_path, kind):
    def fill(bag):
        for i in range(50):
            bag.grasp("/grasp", START + 0.1 * i, [i, 2 * i, 3 * i], 0.5 * i, i % 2, "ab"[i // 25], circle(i))

    path = written(tmp_path, kind, fill)
    demos = uc.load(
        path, state=["grip", "pose.position.x"], action=["force[2]", "mode"], episode="label", topic="/grasp"
    )
    np.testing.assert_array_equal(demos.states[:, 0], 0.5 * np.arange(50))
    np.testing.assert_array_equal(demos.actions, np.column_stack([3 * np.arange(50), np.arange(50) % 2]))
    assert demos.episode_labels == ("a", "b")
    assert any("no message of /grasp carries a stamp" in note for note in demos.notes)
    assert uc.load(path, state="force", topic="/grasp").states.shape == (50, 3)


def test_the_only_topic_with_numbers_is_read_and_said(tmp_path):
    def fill(bag):
        for i in range(20):
            bag.stamped_pose("/pose", START + 0.1 * i, circle(0.1 * i))
            text = bag.make("std_msgs/msg/String", data="hello")
            bag.write("/chatter", "std_msgs/msg/String", START + 0.1 * i, text)

    demos = uc.load(written(tmp_path, "mcap", fill), state=XY)
    assert len(demos) == 20
    assert any("/pose is read, the only one with numbers; topic=" in note for note in demos.notes)


def test_several_topics_are_listed_with_type_and_count(tmp_path):
    path = written(tmp_path, "db3", two_rates)
    sentence = (
        r"run: give topic=, .*/joints \(sensor_msgs/msg/JointState, 41 messages\), "
        r"/pose \(geometry_msgs/msg/PoseStamped, 100 messages\)"
    )
    with pytest.raises(DataError, match=sentence):
        uc.load(path, state=XY)
    with pytest.raises(
        DataError, match=r"has no topic '/pos' with messages \(did you mean '/pose'\?\); there are"
    ):
        uc.load(path, state=XY, topic="/pos")
    with pytest.raises(
        DataError, match=r"give state=, the columns that are states; its columns are 0 'stamp', 1"
    ):
        uc.load(path, topic="/pose")
    with pytest.raises(DataError, match=r"no column 'pose.position.q' for state \(did you mean"):
        uc.load(path, topic="/pose", state="pose.position.q")


def test_names_of_joints_become_names_of_columns(tmp_path):
    demos = uc.load(
        written(tmp_path, "bag", two_rates), topic="/joints", state=["position.shoulder", "position.elbow"]
    )
    assert demos.state_names == ("position.shoulder", "position.elbow")
    np.testing.assert_allclose(demos.states, np.arange(41)[:, None] * [-0.1, 0.05])
    every = uc.load(tmp_path / "run.bag", topic="/joints", state="position")
    assert every.state_names == ("position.elbow", "position.shoulder")


def test_joints_in_another_order_are_put_right_and_others_refused(tmp_path):
    def shuffled(bag):
        for i in range(20):
            names, values = ["a", "b"], [i, -i]
            bag.joints("/joints", START + 0.1 * i, names[:: (-1) ** i], values[:: (-1) ** i])

    demos = uc.load(written(tmp_path, "mcap", shuffled), topic="/joints", state=["position.a", "position.b"])
    np.testing.assert_array_equal(demos.states, np.arange(20)[:, None] * [1, -1])
    assert any("name of /joints comes in several orders" in note for note in demos.notes)

    def mixed(bag):
        for i in range(20):
            bag.joints("/joints", START + 0.1 * i, ["a", "b"] if i % 2 else ["finger", "thumb"], [i, -i])

    with pytest.raises(DataError, match="'position' belongs to other name in some messages than in others"):
        uc.load(written(tmp_path, "mcap", mixed, "mixed"), topic="/joints", state="position")


@pytest.mark.parametrize("stamp", [lambda i: 0.0, lambda i: START, lambda i: 0.0 if i == 7 else START + i])
def test_where_stamps_are_missing_the_time_of_receipt_is_the_time(tmp_path, stamp):
    def fill(bag):
        for i in range(40):
            bag.stamped_pose("/pose", stamp(i), circle(0.1 * i), received=START + 0.1 * i)

    demos = uc.load(written(tmp_path, "mcap", fill), state=XY)
    np.testing.assert_allclose(demos.time, 0.1 * np.arange(40), atol=1e-9)
    lack = (
        "1 of 40 messages of /pose carry no stamp"
        if stamp(0) != stamp(1)
        else "no message of /pose carries a"
    )
    assert any("receive_time" in note and "(10 a second)" in note and lack in note for note in demos.notes)


def test_bursts_are_said_and_the_stamps_are_used(tmp_path):
    def fill(bag):
        for i in range(100):
            received = START + 0.1 * (i // 5) + 2e-5 * (i % 5)
            bag.stamped_pose("/pose", START + 0.02 * i, circle(0.02 * i), received=received)

    path = written(tmp_path, "mcap", fill)
    demos = uc.load(path, state=XY)
    assert np.linalg.norm(demos.actions, axis=1)[10:-10].std() < 1e-3
    assert any("80 of 100 messages came right after the one before, in bursts" in n for n in demos.notes)
    late = uc.load(path, state=XY, time="receive_time", gap=1)
    assert any("time is receive_time" in note and "in bursts; time=stamp" in note for note in late.notes)


def test_topics_are_aligned_to_the_first(tmp_path):
    path = written(tmp_path, "mcap", two_rates)
    state = ["/pose/pose.position.x", "/joints/position.shoulder"]
    demos = uc.load(path, state=state, topic=["/pose", "/joints"])
    t = 0.02 * np.arange(100)
    assert demos.state_names == tuple(state)
    np.testing.assert_allclose(demos.states, np.column_stack([np.cos(t), -2 * t]), atol=1e-6)
    slow = uc.load(path, state=state, topic=["/joints", "/pose"])
    assert len(slow) == 40  # the last is after all poses
    assert any("left out 1 of 41 messages of /joints" in note for note in slow.notes)


def test_rows_in_gaps_of_another_topic_are_left_out_and_counted(tmp_path):
    def fill(bag):
        for i in range(200):
            bag.stamped_pose("/pose", START + 0.02 * i, circle(0.02 * i))
        for i in range(81):
            if not 30 < i < 50:
                bag.joints("/joints", START + 0.05 * i, ["a"], [0.05 * i])

    demos = uc.load(
        written(tmp_path, "bag", fill),
        topic=["/pose", "/joints"],
        state="/joints/position.a",
        action=["/pose/pose.position.x"],
    )
    inside = [0.02 * i for i in range(200) if not 1.5 + 1e-9 < 0.02 * i < 2.5 - 1e-9]
    np.testing.assert_allclose(demos.states[:, 0], inside, atol=1e-6)
    left_out = 200 - len(inside)
    assert any(f"left out {left_out} of 200 messages of /pose" in note for note in demos.notes)


def test_quaternions_and_whole_numbers_are_those_of_the_nearest(tmp_path):
    def fill(bag):
        for i in range(50):
            bag.stamped_pose("/slow", START + 0.1 * i, circle(i), (0, 0, 0, 1 - 2 * (i % 2)))
        for i in range(100):
            bag.stamped_pose("/fast", START + 0.05 * i - 0.01, circle(i))

    demos = uc.load(
        written(tmp_path, "db3", fill),
        topic=["/fast", "/slow"],
        state=["/slow/pose.orientation.w"],
        action=["/slow/pose.position.x"],
    )
    assert set(demos.states[:, 0]) == {-1.0, 1.0}


def test_no_value_is_made_up_where_an_angle_begins_anew(tmp_path):
    def fill(bag):
        for i in range(60):
            turned = (0.1 * i + np.pi) % (2 * np.pi) - np.pi
            bag.joints("/yaw", START + 0.1 * i, ["yaw"], [turned])
            bag.stamped_pose("/pose", START + 0.1 * i + 0.03, circle(i))

    demos = uc.load(
        written(tmp_path, "bag", fill),
        topic=["/pose", "/yaw"],
        state="/yaw/position.yaw",
        action="/pose/pose.position.x",
    )
    away = np.exp(1j * demos.states[:, 0]) * np.exp(-1j * (0.1 * np.arange(len(demos)) + 0.03))
    assert np.abs(np.angle(away)).max() < 0.05


def test_the_likeliest_topics_come_first(tmp_path):
    def fill(bag):
        two_rates(bag)
        for i in range(200):
            bag.grasp("/grasp", START + 0.01 * i, [1, 2, 3], i)
        bag.transforms("/tf_static", START, tool=(1, 2, 3))

    (file,) = locate(files_of(written(tmp_path, "mcap", fill), "mcap")[1:])
    assert RosBag(file).topics_of_movement() == ("/pose", "/joints", "/grasp")


def test_topics_that_never_meet_are_refused(tmp_path):
    def fill(bag):
        for i in range(20):
            bag.stamped_pose("/early", START + i, circle(i), received=START + i)
            bag.stamped_pose("/late", START + 100 + i, circle(i), received=START + i)

    with pytest.raises(DataError, match="no message of /early lies between messages of /late"):
        uc.load(written(tmp_path, "bag", fill), topic=["/early", "/late"], state="/early/pose.position.x")


def test_transforms_are_read_frame_by_frame(tmp_path):
    def fill(bag):
        for i in range(50):
            moves = {"tool": circle(0.1 * i)} | ({} if i % 2 else {"camera": (i, 0, 0)})
            bag.transforms("/tf", START + 0.1 * i, **moves)

    path = written(tmp_path, "mcap", fill)
    tool = uc.load(path, topic="/tf:tool", state=["transform.translation.x", "transform.translation.y"])
    np.testing.assert_allclose(tool.states, [circle(0.1 * i)[:2] for i in range(50)])
    both = uc.load(path, topic="/tf", state="transform.translation.x", episode="child_frame_id")
    assert both.episode_labels == ("tool", "camera")
    assert any("several frames; topic=/tf:camera reads one of them" in note for note in both.notes)
    with pytest.raises(DataError, match="holds no transforms of the frame 'arm'"):
        uc.load(path, topic="/tf:arm", state="transform.translation.x")


def test_each_bag_is_an_episode(tmp_path):
    for name in "ab":
        written(tmp_path, "mcap", two_rates, name)
    demos = uc.load([tmp_path / "a", tmp_path / "b"], topic="/pose", state=XY)
    assert demos.episode_labels == ("a", "b")
    blocks = list(uc.open([tmp_path / "a", tmp_path / "b"], topic="/pose", state=XY).blocks(10))
    np.testing.assert_array_equal(np.concatenate([block.states for block in blocks]), demos.states)


def test_a_suffix_does_not_matter(tmp_path):
    path = written(tmp_path, "mcap", two_rates)
    copy = tmp_path / "recording.dat"
    shutil.copy(files_of(path, "mcap")[1], copy)
    assert len(uc.load(copy, topic="/pose", state=XY)) == 100


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_that_was_cut_short_is_refused_in_a_sentence(tmp_path, kind):
    path = files_of(written(tmp_path, kind, two_rates), kind)[-1]
    content = path.read_bytes()
    for share in (0.02, 0.3, 0.6, 0.9, 0.99):
        path.write_bytes(content[: int(share * len(content))])
        with pytest.raises(
            DataError, match=rf"{path.name} is damaged, cut short or no ROS bag .*recover it with"
        ):
            uc.load(path, topic="/pose", state=XY)
    noise = bytearray(content)
    middle = len(content) // 2
    noise[middle : middle + 200] = bytes(range(200))
    path.write_bytes(noise)
    with contextlib.suppress(DataError):  # sqlite3 has no checksums, so numbers may come out wrong instead
        uc.load(path, topic="/pose", state=XY)


def test_a_bag_that_does_not_define_its_messages_is_read_as_of_humble(tmp_path):
    path = files_of(written(tmp_path, "db3", two_rates), "db3")[1]
    with contextlib.closing(sqlite3.connect(path)) as database, database:
        database.execute("DELETE FROM message_definitions")
    demos = uc.load(path, topic="/pose", state=XY)
    assert len(demos) == 100
    assert any(
        "does not define its messages, which are read as those of ROS 2 Humble" in n for n in demos.notes
    )
    grasp = files_of(
        written(tmp_path, "db3", lambda bag: bag.grasp("/grasp", 1.0, [1, 2, 3], 0), "own"), "db3"
    )[1]
    with contextlib.closing(sqlite3.connect(grasp)) as database, database:
        database.execute("DELETE FROM message_definitions")
    with pytest.raises(DataError, match="does not say what messages of type lab_msgs/msg/Grasp consist of"):
        uc.load(grasp, topic="/grasp", state="grip")


def test_messages_in_the_log_of_a_database_are_missed_aloud(tmp_path):
    path = files_of(written(tmp_path, "db3", two_rates), "db3")[1]
    path.with_name(f"{path.name}-wal").write_bytes(b"unfinished")
    for given in (path, path.parent):
        assert any("(-wal) are not read" in note for note in uc.load(given, topic="/pose", state=XY).notes)


def test_other_files_have_no_topics(tmp_path):
    (tmp_path / "run.csv").write_text("t,x\n0,0\n0.1,1\n0.2,2\n0.3,3\n")
    with pytest.raises(DataError, match=r"run\.csv has no topics, as only ROS bags have: leave out topic="):
        uc.load(tmp_path / "run.csv", state="x", time="t", topic="/odom")
    with pytest.raises(DataError, match=r"topic takes the name of a topic or a list of them, got \[\]"):
        uc.load(tmp_path / "run.csv", state="x", time="t", topic=[])


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    path = written(tmp_path, "bag", two_rates)
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(DataError, match=r"pip install 'unconstrain\[ros\]'"):
        uc.load(path, topic="/pose", state=XY)


def test_an_open_bag_can_be_sent_to_another_process(tmp_path):
    (file,) = locate([written(tmp_path, "bag", two_rates)])
    bag = RosBag(file, ("/pose",))
    assert bag.row_groups == (100,)
    light = pickle.dumps(RosBag(*locate([tmp_path / "run.bag"]), ("/pose",)))
    assert len(light) < 2000
    assert "_table" not in bag.__getstate__()
    assert pickle.loads(light).columns().columns == bag.columns().columns


def run(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["unconstrain", *map(str, words)])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code


def test_a_saved_policy_keeps_the_topic(tmp_path, monkeypatch, capsys):
    path = written(tmp_path, "mcap", two_rates)
    policy = tmp_path / "p.skops"
    assert not run(monkeypatch, "fit", path, "--topic", "/pose", "--state", ",".join(XY), "--out", policy)
    assert (
        "note: run: time is the stamps in the messages (50 a second); --time receive_time"
        in capsys.readouterr().out
    )
    assert uc.load_policy(policy).recording_[0].topic == "/pose"
    assert not run(monkeypatch, "evaluate", policy, path)
    state = "/pose/pose.position.x,/joints/position.elbow"
    for topics in (["--topic", "/pose,/joints"], ["--topic", "/pose", "--topic", "/joints"]):
        assert not run(monkeypatch, "fit", path, *topics, "--state", state, "--out", policy, "--overwrite")
        assert list(uc.load_policy(policy).recording_[0].topic) == ["/pose", "/joints"]


@pytest.mark.skipif(not NAV2.exists(), reason="the recordings are not part of the project")
def test_the_robot_that_drives():
    demos = uc.load(NAV2, topic="/odom", state=["pose.pose.position.x", "pose.pose.position.y"])
    assert len(demos) == 2639
    assert any("(27.78 a second)" in note and "21 of 2639" in note for note in demos.notes)
    driven = uc.load(
        NAV2,
        topic="/odom",
        state=["pose.pose.position.x", "pose.pose.position.y"],
        action=["twist.twist.linear.x", "twist.twist.linear.y"],
    )
    speed, told = (np.linalg.norm(each.actions, axis=1) for each in (demos, driven))
    assert np.corrcoef(speed, told)[0, 1] > 0.9
    assert np.median(speed) == pytest.approx(np.median(told), rel=0.1)
    assert any("along the axes of the moving base_link" in note for note in driven.notes)


@pytest.mark.parametrize("kind", KINDS)
def test_messages_that_come_late_are_put_into_order(tmp_path, kind):
    order = np.arange(60)
    order[[20, 21, 40, 42]] = order[[21, 20, 42, 40]]

    def fill(bag):
        for place, i in enumerate(order):
            bag.stamped_pose("/pose", START + 0.1 * i, circle(0.1 * i), received=START + 0.1 * place)

    path = written(tmp_path, kind, fill)
    demos = uc.load(path, state=XY)
    np.testing.assert_allclose(demos.time, np.arange(60) * 0.1, atol=1e-6)
    np.testing.assert_allclose(demos.states[:, 0], np.cos(demos.time), atol=1e-6)
    assert any("messages of /pose came after later ones" in note for note in demos.notes)


def test_a_clock_that_was_set_back_is_refused(tmp_path):
    def fill(bag):
        for i in range(80):
            bag.stamped_pose("/pose", START + 0.1 * (i % 40), circle(0.1 * i), received=START + 0.1 * i)

    with pytest.raises(DataError, match="goes back at message 40"):
        uc.load(written(tmp_path, "mcap", fill), state=XY)


def test_a_folder_of_bags_is_read_bag_by_bag(tmp_path):
    def fill(bag):
        for i in range(40):
            bag.stamped_pose("/pose", START + 0.1 * i, circle(0.1 * i))

    (tmp_path / "bags").mkdir()
    for name in ("a", "b"):
        whole = written(tmp_path, "mcap", fill, name)
        shutil.copy(next(whole.glob("*.mcap")), tmp_path / "bags" / f"{name}.mcap")
    demos = uc.load(tmp_path / "bags", state=XY)
    assert demos.episode_labels == ("a", "b")
    (tmp_path / "bags" / "other.csv").write_text("x\n1\n")
    with pytest.raises(DataError, match=r"2 \.mcap.*1 \.csv"):
        uc.load(tmp_path / "bags", state=XY)


@pytest.mark.parametrize("kind", ["mcap", "db3"])
def test_the_file_of_a_compressed_bag_is_read_too(tmp_path, kind):
    from rosbags import rosbag2

    bag = Writing(tmp_path / "run", kind)
    bag._writer.set_compression(rosbag2.CompressionMode.FILE, rosbag2.CompressionFormat.ZSTD)
    with bag:
        for i in range(40):
            bag.stamped_pose("/pose", START + 0.1 * i, circle(0.1 * i))
    path = next((tmp_path / "run").glob("*.zst*"))
    np.testing.assert_array_equal(uc.load(path, state=XY).states, uc.load(tmp_path / "run", state=XY).states)
