(comment) @comment
["acceleration" "accelerations" "at" "damped" "efforts" "expressed" "gain" "gravity" "import" "in" "inverse" "iterations" "jacobian" "kinematics" "libm" "limits" "mass_matrix" "math" "null" "payload" "period" "pose" "posture" "restarts" "seed" "solver" "std" "tolerance" "velocity" "within"] @keyword
(kinematics "kinematics" . (name) @type)
(posture "posture" . (name) @type)
(solver "solver" . (name) @type)
(payload "payload" . (name) @type)
(seed "seed" . (name) @type)
(null "posture" . (name) @type)
(string) @string
(number) @number
["{" "}"] @punctuation.bracket
["," ";" "="] @punctuation.delimiter
