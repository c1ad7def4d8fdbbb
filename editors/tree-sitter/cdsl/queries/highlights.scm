(comment) @comment
["any" "as" "available" "budget" "collect" "communications" "component" "dependencies" "exact" "external" "gui" "h" "implements" "import" "kinematics" "language" "latest" "lifecycle" "min" "ms" "optional" "options" "parameters" "period" "publishes" "python" "reactions" "reads" "request" "requires" "s" "shared" "simulates" "spin" "statemachine" "stream" "subscribesto" "time" "us" "venv" "visual" "within" "world" "writes"] @keyword
(component "component" . (name) @type)
(gui "gui" . (name) @type)
(options "options" . (name) @type)
(kinematics "as" . (name) @type)
(world "as" . (name) @type)
(collect "as" . (name) @type)
(lifecycle "lifecycle" . (name) @type)
(string) @string
(number) @number
(duration) @number
["(" ")" "[" "]" "{" "}"] @punctuation.bracket
["," "->" "." ";"] @punctuation.delimiter
