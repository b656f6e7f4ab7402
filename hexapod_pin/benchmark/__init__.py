"""Speed against error: what every method, and every engine that is installed, costs on a scene.

`comparison` measures a `task` with `entry`s (ours in `settings`, other engines in `engines`)
against a `reference`; `levels` reads the rows; `report`, `terminal` and `figure` show them;
`advice` recommends a method; `command` is the job of `hexapod-pin bench`.
"""
