[(kinematics) (posture) (solver)] @indent.begin @indent
"}" @indent.branch @indent.end @outdent
