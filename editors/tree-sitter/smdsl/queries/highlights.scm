(comment) @comment
["end_state" "initial_state" "parallel" "states" "transition" "transitions"] @keyword
(states "states" . (name) @type)
(initial "initial_state" . (name) @type)
(end "end_state" . (name) @type)
["{" "}"] @punctuation.bracket
["," ":" ";" "=>"] @punctuation.delimiter
