# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The stream reader of the package icotronic, reading a flood; prints CPU time in s and frames.

The package has no option for host and port of the server: python-can takes them from CAN_CONFIG.
"""

from __future__ import annotations

import asyncio
import logging
import os
import sys
import time

from icotronic.can.connection import Connection
from icotronic.can.streaming import StreamingConfiguration


async def main() -> None:
    """Read the frames."""
    logging.getLogger("can").setLevel(logging.CRITICAL)  # else it warns per piece that it reads
    first, last = map(int, sys.argv[1:])
    count = missing = 0
    async with (Connection() as stu, stu.connect_sensor_node("Bench") as node,
                node.open_data_stream(StreamingConfiguration(first=True)) as stream):
        async for _, lost in stream:
            count += 1
            missing += lost
            if count == first:
                start = time.process_time()
            elif count == last:
                print(time.process_time() - start, last - first, missing, flush=True)
                os._exit(0)  # the flood would go on


if __name__ == "__main__":
    asyncio.run(main())
