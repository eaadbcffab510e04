"""The studio in the browser: one page, a tab for each thing that one does to trees.

| file | what |
|---|---|
| `shell` | the page with its tabs, and what a tab is (`Tab`) |
| `modeller` | the Model tab: move a slider, see the tree |
| `years` | the Years tab: grow and prune, year by year |
| `scan` | the Scan tab: a cloud and what was made of it |
| `worker` | one thread that makes what was asked for last |
| `history` | undo and redo of everything |
| `view` | a picture that the browser draws |
| `folders` | where files may be opened and written |
| `address`, `server` | serves the page |

Only the tabs, `shell`, `view` and `server` need the extra `studio`.
"""
