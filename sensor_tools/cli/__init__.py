"""The command `sensors`: one file per subcommand, and what they share.

`program` puts the commands together, `places` has the options that say which sensor is meant,
`sensor` reaches it, `output` prints.
"""
