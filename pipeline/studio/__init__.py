"""The modeller in the browser: move a slider, see the tree.

| file | what |
|---|---|
| `parameters` | the twenty parameters, what each changes, and values in words |
| `history` | undo and redo of everything |
| `modelling` | from parameters to a drawn tree; what is made already is kept |
| `worker` | one thread that models what was asked for last |
| `files` | parameters and models, as files or as downloads |
| `session` | what one sitting holds, without a browser |
| `scene` | the picture; the browser draws it |
| `layout` | what stands where on the page |
| `page` | what its buttons do, and what the worker's news change |
| `address`, `server` | serves the page |

Only `scene`, `layout`, `page` and `server` need the extra `studio`.
"""
