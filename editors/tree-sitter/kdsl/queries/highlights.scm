(comment) @comment
["acceleration" "accelerations" "actuator" "as" "at" "closed_positions" "closed_velocities" "damped" "efforts" "expressed" "fixed" "floating" "frames" "gain" "gravity" "holding" "import" "in" "inverse" "iterations" "jacobian" "joint" "kinematics" "lengths" "limits" "loop" "loop_errors" "loop_forces" "loop_jacobian" "mass_matrix" "math" "matrices" "null" "passive" "payload" "period" "planar" "point" "pose" "positions" "posture" "prismatic" "quaternion" "restarts" "revolute" "rpy" "scalars" "seed" "solver" "spherical" "tolerance" "velocities" "velocity" "within"] @keyword
(alias "as" . (name) @type)
(kinematics "kinematics" . (name) @type)
(ring "loop" . (name) @type)
(posture "posture" . (name) @type)
(solver "solver" . (name) @type)
(payload "payload" . (name) @type)
(seed "seed" . (name) @type)
(null "posture" . (name) @type)
(string) @string
(number) @number
["{" "}"] @punctuation.bracket
["," ";" "="] @punctuation.delimiter
