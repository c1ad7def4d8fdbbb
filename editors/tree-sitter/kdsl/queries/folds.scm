[(kinematics) (posture) (solver)] @fold
(comment) @fold
