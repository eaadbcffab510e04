"""The Model tab: move a slider, see the tree.

| file | what |
|---|---|
| `parameters` | the twenty parameters, what each changes, and values in words |
| `modelling` | from parameters to a drawn tree; what is made already is kept |
| `files` | parameters and models, as files or as downloads |
| `pictures` | pictures of bark and leaves that a person gives |
| `session` | what one sitting holds, without a browser |
| `scene` | the picture; the browser draws it |
| `words` | figures as the page tells them |
| `layout` | what stands where |
| `actions`, `tab` | what its buttons do, and what the worker's news change |

Only `scene`, `layout` and `tab` need the extra `studio`.
"""
