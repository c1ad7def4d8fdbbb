[(kinematics) (ring) (posture) (solver)] @fold
(comment) @fold
