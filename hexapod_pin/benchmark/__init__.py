"""Speed against error: what every method, and every engine that is installed, costs on a scene.

`comparison` measures a `task` with `contender`s (ours in `settings`, other engines in `peers`)
against a `reference`; `levels` reads the rows; `report`, `terminal` and `figure` show them;
`advice` recommends a method; `command` is the job of `hexapod-pin bench`.
"""
