[(kinematics) (ring) (posture) (solver)] @indent.begin @indent
"}" @indent.branch @indent.end @outdent
