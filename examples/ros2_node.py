"""
A ROS 2 node
============

For people whose robot speaks ROS 2: each message of joint states becomes an action of a compiled policy, and that a
trajectory of one point, a tenth of a second ahead. Run ``python ros2_node.py step.npz shoulder,elbow,wrist`` where
ROS 2 is sourced; the joints are named in the order of the policy's states. Nothing above `main` needs ROS.
"""

# %%
# The messages name joints in an order of their own, and may have more of them than the policy.

import sys

import numpy as np

import unconstrain as uc


def read_state(message, joints):
    """Return the positions of `joints` from a sensor_msgs/JointState, whatever its order."""
    places = dict(zip(message.name, message.position, strict=False))
    if missing := [joint for joint in joints if joint not in places]:
        raise uc.errors.DataError(
            f"the joint states have no position of {', '.join(missing)}: they have {', '.join(places) or 'none'}"
        )
    state = np.array([places[joint] for joint in joints], dtype=np.float64)
    if not np.isfinite(state).all():
        raise uc.errors.DataError(f"the joint states of {', '.join(joints)} are not all numbers: {state}")
    return state


def write_command(trajectory, point, joints, state, action, dt):
    """Fill a trajectory_msgs/JointTrajectory with the one point where the action leads in `dt` seconds."""
    # Without a velocity: controllers refuse a trajectory that ends with one.
    point.positions = (state + dt * action).tolist()
    point.time_from_start.sec, point.time_from_start.nanosec = divmod(round(1e9 * dt), 10**9)
    trajectory.joint_names, trajectory.points = list(joints), [point]
    return trajectory


# %%
# The node. Where a message lacks a joint it says so and sends nothing: the controller then holds the arm at the last
# point. A compiled policy acts anywhere, so mind where the arm is at the start; limits are the controller's to keep.


def main(path, joints, dt=0.1):
    """Act on each message of /joint_states until interrupted."""
    import rclpy
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    rclpy.init()
    node, step = rclpy.create_node("unconstrain"), uc.load_compiled(path)
    commands = node.create_publisher(JointTrajectory, "/joint_trajectory_controller/joint_trajectory", 1)

    def act(message):
        try:
            state = read_state(message, joints)
        except uc.errors.DataError as error:
            node.get_logger().error(str(error), throttle_duration_sec=1.0)
            return
        commands.publish(
            write_command(JointTrajectory(), JointTrajectoryPoint(), joints, state, step(state), dt)
        )

    node.create_subscription(JointState, "/joint_states", act, 1)
    rclpy.spin(node)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2].split(","))
