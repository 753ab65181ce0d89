"""Move an arm that is not the twin's: one interface, for a simulated arm and for a real one behind rosbridge.

`robot.Robot` is the interface: connect, state, approve, follow, grip, stop. It owns what keeps an arm safe, for every
arm alike: limits, the comparison of each joint state with what is planned, the stop, and the approval without which
nothing moves. A `link.Link` is a way to one arm: `simulation` or `rosbridge`.

The protocol is rosbridge v2: JSON objects with an "op" over a websocket. Joint states come from a subscription. A
motion is the action FollowJointTrajectory. For ROS 1 (kinova-ros) rosbridge knows no actions: the topics ACTION/goal,
/cancel and /result of actionlib are published and subscribed to, and the fingers have the action SetFingersPosition.
For ROS 2 (ros2_kortex) they are the ops `send_action_goal`, `cancel_action_goal` and `action_result`, and the hand has
the action GripperCommand.
"""
