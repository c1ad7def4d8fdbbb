(comment) @comment
["composed_by" "consistency" "domain" "dproto" "entity" "h" "history" "import" "interpolated" "key" "min" "ms" "of" "open" "optional" "promotes" "query" "relation" "require" "s" "topic" "tree" "unit" "us"] @keyword
(domain "domain" . (name) @type)
(entity "entity" . (name) @type)
(composed_by "composed_by" . (name) @type)
(block "dproto" . (name) @type)
(relation "relation" . (name) @type)
(tree_of "of" . (name) @type)
(promotes "promotes" . (name) @type)
(require "of" . (name) @type)
(query "query" . (name) @type)
(string) @string
(number) @number
(duration) @number
["(" ")" "[" "]" "{" "}"] @punctuation.bracket
["!=" "," "." ":" ";" "<" "<=" "==" ">" ">="] @punctuation.delimiter
