# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The lifecycle node that all drivers share: the bus thread, topics, diagnostics, shut-down."""

from __future__ import annotations

import sys
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from lifecycle_msgs.srv import ChangeState
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.publisher import Publisher
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from driver_common import diagnostics, node_recorder, program
from driver_common.device_thread import CALL_TIMEOUT, Bus, DeviceThread
from driver_common.errors import DriverError, SettingError
from driver_common.middleware import let_events_wait
from driver_common.node_recorder import NodeRecorder
from driver_common.parameter_node import ParameterNode
from driver_common.recording import SERIAL
from driver_common.settings import Option

STOP_TIME = 2.0  # s for which a user waits until devices are stopped

Action = Callable[[], Awaitable[str]]

CONFIG_MODES = {"push": 0, "check": 1, "leave": 2}

FRAME_ID = Option(
    "frame_id", kind=str, default="{sensor}_link", pattern=r"[^/\s]\S*", live=True,
    description="Frame of the measurements, a name without spaces and without a slash in front")
TIME_OFFSET = Option(
    "time_offset", kind=float, default=0.0, minimum=-10.0, maximum=10.0, unit="s", live=True,
    description="Added to every stamp; negative where the measurement was earlier")
_COMMON_OPTIONS = (
    Option("autostart", kind=bool, default=True,
           description="Configure and activate without being asked"),
    Option("config_mode", kind=str, choices=CONFIG_MODES, default="push",
           description="What to do with settings that differ from the parameters given: "
                       "push = write them, check = warn, leave = nothing"),
    *node_recorder.OPTIONS,
)


class Simulator(Protocol):
    """Simulated devices on a real transport."""

    def close(self) -> None:
        """End them."""


class Topic(NamedTuple):
    """A topic that a node publishes for each sensor: message type, and messages that it keeps."""

    kind: Any
    depth: int = 10


class DeviceNode(ParameterNode):
    """A driver: a bus with one or more devices.

    Subclasses give the options and the bus, and publish what the bus reports.

    Attributes:
        thread: The thread that serves it.
        simulator: What `make_bus` started to have something to talk to.
    """

    KIND = "sensor"  # what a device without a name is called
    LINK = SERIAL  # what its recordings are of
    COMMON_OPTIONS = _COMMON_OPTIONS
    TOPICS: Mapping[str, Topic] = {}

    def __init__(self, name: str) -> None:
        """Declare the options; raises SettingError where one has an unacceptable value."""
        super().__init__(name)
        self.thread: DeviceThread | None = None
        self.simulator: Simulator | None = None
        self._stopping = False
        self._bus_error: DriverError | None = None
        self._statuses: list[DiagnosticStatus] = []
        self._statuses_due = 0.0
        self._statuses_made = 0.0
        self._diagnostics = diagnostics.Diagnostics(self)
        self._recorder = NodeRecorder(self, self.LINK, self.channel, self.link_facts)
        self._entities: list[Publisher] = []
        self.create_timer(diagnostics.PERIOD, self._publish_diagnostics,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.create_timer(node_recorder.PERIOD, self._recorder.write_raw,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._refuse_impossible_transitions()
        self._add_services()

    # --- what a driver provides ---

    def make_bus(self) -> Bus:
        """Return the session, not yet opened; raises DriverError."""
        raise NotImplementedError

    def make_interfaces(self, sensor: str) -> None:
        """Create the publishers of a sensor that do not depend on its model."""

    def services_of(self, sensor: str) -> dict[str, Action]:
        """Return what a user can have done with a sensor, each with its name and its answer."""
        return {"start_acquisition": partial(self._enable, sensor, True),
                "stop_acquisition": partial(self._enable, sensor, False)}

    def channel(self) -> str:
        """Return the name of the bus in a recording, "" where it has none."""
        return ""

    def link_facts(self) -> dict[str, str]:
        """Return what a recording says of the link."""
        return {}

    def describe(self, device: Any) -> str:
        """Return what was found, for the log."""
        raise NotImplementedError

    def status_of(self, device: Any) -> DiagnosticStatus:
        """Return the diagnostics of a device."""
        raise NotImplementedError

    # --- the bus ---

    async def call(self, job: Callable[[], Any], timeout: float = CALL_TIMEOUT, *,
                   interrupt: bool = False) -> Any:
        """Run a job in the thread of the bus while others are served; see `DeviceThread.call`."""
        executor = self.executor
        assert executor is not None  # which runs this
        return await self._running_thread.ask(job, timeout, interrupt=interrupt,
                                              on_done=executor.wake)

    @property
    def _running_thread(self) -> DeviceThread:
        if self.thread is None:
            raise DriverError(self._unconfigured())
        return self.thread

    def unreachable(self) -> str:
        """Return why no device can be reached, "" where one may be."""
        if self._bus_error is not None:
            return str(self._bus_error)
        return self._unconfigured() if self.bus is None else ""

    def _unconfigured(self) -> str:
        return ("the node is not configured; run 'ros2 lifecycle set "
                f"{self.get_fully_qualified_name()} configure'")

    def device(self, sensor: str) -> Any:
        """Return the device of a sensor; raises DriverError where the node is not configured."""
        if self.bus is None:
            raise DriverError(self._unconfigured())
        return next(device for device in self.bus.devices if device.options.name == sensor)

    async def _enable(self, sensor: str, enabled: bool) -> str:
        # The bus goes on with it where it takes longer than anybody wants to wait.
        await self.call(lambda: self.bus.set_enabled(self.device(sensor), enabled),
                        CALL_TIMEOUT if enabled else STOP_TIME, interrupt=not enabled)
        return f"acquisition {'started' if enabled else 'stopped'}"

    async def give_address(self, sensor: str, give: Callable[[int], object]) -> str:
        """Run `give` with the parameter new_address; return what the user is told then."""
        prefix = self.prefix(sensor)
        address = self.option("new_address", sensor)
        if not address:
            raise SettingError(f"set the parameter {prefix}new_address first")
        old = self.device(sensor).address
        await self.call(lambda: give(address))
        self.store.store({prefix + "address": address, prefix + "new_address": 0})
        return (f"the sensor moved from address {old} to {address} and keeps it; put "
                f"'{prefix}address: {address}' into your parameter file")

    # --- what the bus reports, in its thread ---

    def on_found(self, device: Any) -> None:
        """Show the device's settings as parameters."""
        self._note_news()
        description = self.describe(device)
        self._recorder.note_found(device, description)
        self.get_logger().info(f"{device.title}: connected to {description}")
        self.show_settings(device.options.name, device)

    def on_values(self, device: Any) -> None:
        """Show the values that were read again."""
        self.show_settings(device.options.name, device)

    def on_lost(self, device: Any, error: DriverError) -> None:
        """Log why there is no device."""
        self._note_news()
        self._recorder.note_error(f"{device.title}: {error}")
        self.get_logger().error(f"{device.title}: {error} (waiting for it)")

    def on_note(self, device: Any, text: str, *, warning: bool = False) -> None:
        """Log a line."""
        if warning:  # rclpy takes one severity per line of code only
            self.get_logger().warning(f"{device.title}: {text}")
        else:
            self.get_logger().info(f"{device.title}: {text}")

    def on_step(self, pause: float) -> None:
        """Take note that the bus did a step, and of the time in s until the next one."""
        self._recorder.look_at_replay()
        self._note_statuses(pause)

    def on_bus_state(self, error: DriverError | None) -> None:
        """Take note that the link opened or failed; one line in the log per change."""
        if not self.context.ok():
            return
        if error is None:
            self._note_link_works()
            return
        if str(error) != str(self._bus_error):
            self._recorder.note_error(str(error))
            self.get_logger().error(f"{error} (waiting for it)")
        self._bus_error = error

    def _note_news(self) -> None:
        """A device tells something: so the link works, and the diagnostics are to show it."""
        self._note_link_works()
        self._statuses_due = 0.0

    def _note_link_works(self) -> None:
        if self._bus_error is not None:
            self._recorder.note_link_works()
            self.get_logger().info("the link is open again")
        self._bus_error = None

    # --- interfaces ---

    @staticmethod
    def topic(sensor: str, name: str) -> str:
        """Return the name of a sensor's topic or service."""
        return f"~/{sensor}/{name}" if sensor else f"~/{name}"

    def add_publisher(self, sensor: str, name: str) -> Any:
        """Create the reliable publisher of a topic, whose QoS can be overridden; gone at clean-up.

        Raises:
            SettingError: An override is not acceptable.
        """
        kind, depth = self.TOPICS[name]
        topic = self.topic(sensor, name)
        try:
            publisher = self.create_publisher(
                kind, topic, depth,
                qos_overriding_options=QoSOverridingOptions.with_default_policies())
        except Exception as error:  # rclpy has many for this
            topic = self.resolve_topic_name(topic)
            raise SettingError(f"cannot publish {topic}, check its parameters qos_overrides."
                               f"{topic}.publisher.*: {error or 'a wrong type'}") from error
        self._entities.append(publisher)
        return publisher

    def while_running(self, publish: Callable[..., None]) -> Callable[..., None]:
        """Return `publish`, doing nothing once the context was shut down under the bus thread."""
        def call(*args: Any) -> None:
            try:
                publish(*args)
            except Exception:
                if self.context.ok():
                    raise

        return call

    def _add_services(self) -> None:
        """Create the services, which answer in any state, and while others wait for theirs."""
        services = {self.topic(sensor, name): action for sensor in self.sensors
                    for name, action in self.services_of(sensor).items()}
        services["~/save_recording"] = self._recorder.save
        group = ReentrantCallbackGroup()
        for topic, action in services.items():
            self.create_service(Trigger, topic, self._answering(topic.rpartition("/")[2], action),
                                callback_group=group)

    def _answering(self, name: str, action: Action) -> Callable[..., Awaitable[Trigger.Response]]:
        """Return what answers a service with the text of an action, or with its error."""
        async def handle(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            try:
                response.message = await action()
                response.success = True
            except DriverError as error:
                response.message = str(error)
            except Exception as error:  # an exception here would end the node
                response.message = f"internal error, please report it: {error!r}"
            if response.success:  # rclpy takes one severity per line of code only
                self.get_logger().info(f"{name}: {response.message}")
            else:
                self.get_logger().error(f"{name}: {response.message}")
            return response

        return handle

    # --- diagnostics ---

    def _note_statuses(self, pause: float) -> None:
        """Keep what the diagnostics say; in the thread of the bus, so nothing changes meanwhile.

        Args:
            pause: Time in s until there is anything new.
        """
        now = self._statuses_made = time.monotonic()
        if now + pause < self._statuses_due:
            return
        self._statuses_due = now + 0.9 * diagnostics.PERIOD
        try:
            self._statuses = [self.status_of(device) for device in self.bus.devices]
            for status in self._statuses:
                diagnostics.add_values(status, self._recorder.diagnostics())
        except Exception as error:  # it must not disturb the bus
            text = f"internal error, please report it: {error!r}"
            self.get_logger().error(text, throttle_duration_sec=60.0)
            self._statuses = self._same_for_all(diagnostics.ERROR, text)

    def _publish_diagnostics(self) -> None:
        silence = time.monotonic() - self._statuses_made
        if self.bus is None:
            statuses = self._same_for_all(diagnostics.STALE, "not configured")
        elif self._bus_error is not None:
            statuses = self._same_for_all(diagnostics.ERROR, str(self._bus_error))
        elif silence > diagnostics.LATEST:
            statuses = self._same_for_all(
                diagnostics.ERROR, f"the bus has been busy for {silence:.0f} s without an end; "
                                   "nothing is known of the device meanwhile")
        else:
            statuses = self._statuses
        self._diagnostics.publish(statuses)

    def _same_for_all(self, level: bytes, message: str) -> list[DiagnosticStatus]:
        return [diagnostics.to_status(self.status_name(sensor), "", level, message, {})
                for sensor in self.sensors]

    def status_name(self, sensor: str) -> str:
        """Return the name of a sensor's status, the same whatever happens and in no other node."""
        return f"{self.get_fully_qualified_name().lstrip('/')}: {sensor or self.KIND}"

    # --- lifecycle ---

    def _refuse_impossible_transitions(self) -> None:
        """Answer a transition that is not possible now with a failure; rclpy ends the node."""
        change_state = self._service_change_state.callback

        def handle(request: ChangeState.Request,
                   response: ChangeState.Response) -> ChangeState.Response:
            try:
                return change_state(request, response)
            except RuntimeError as error:
                self.get_logger().warning(f"no such transition in the present state: {error}")
                response.success = False
                return response

        self._service_change_state.callback = handle

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the bus in its own thread, which waits for the devices."""
        try:
            bus = self.make_bus()
            for sensor in self.sensors:
                self.make_interfaces(sensor)
        except DriverError as error:
            self.log_failure(str(error))
            self._close()
            return TransitionCallbackReturn.FAILURE
        self.bus = bus
        self._statuses_due = 0.0
        self._note_statuses(0.0)
        self.thread = DeviceThread(f"{self.get_name()} bus", bus, self.on_bus_state,
                                   self.on_step)
        self._recorder.begin_replay()
        if self._recorder.replay is None:  # which waits until what it tells is wanted
            self.thread.start()
        if self._stopping:
            self.thread.stop()
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start measuring and publishing."""
        assert self.thread is not None
        self.thread.post(lambda: self.bus.set_active(True))
        if self.thread.ident is None:
            self.thread.start()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the devices."""
        try:
            self.bus.active = False  # for what comes next, also where that takes too long
            self._running_thread.call(lambda: self.bus.set_active(False), STOP_TIME,
                                      interrupt=True)
        except DriverError as error:
            self.get_logger().warning(f"some may measure until they are told again: {error}")
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the bus."""
        self._close()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the bus."""
        self._close()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the bus and become unconfigured; the reason was swallowed by rclpy."""
        self.get_logger().error(f"a transition from {state.label} failed")
        self._close()
        return TransitionCallbackReturn.SUCCESS

    def _close(self) -> None:
        if self.thread is not None:
            self.thread.stop()
            self._recorder.finish_raw()
        self._close_simulator()
        self.thread = None
        self.bus = None
        self._bus_error = None
        self._statuses_due = 0.0
        self.undeclare_settings()
        for publisher in self._entities:
            self.destroy_publisher(publisher)
        self._entities.clear()

    def destroy_node(self) -> None:
        """Leave the devices stopped and the port closed."""
        self.stop()
        self._close_simulator()
        super().destroy_node()

    def stop(self) -> None:
        """Leave the devices stopped and the port closed for good; from any thread."""
        self._stopping = True
        thread = self.thread
        if thread is not None:
            thread.stop()
            self._recorder.finish_raw()

    def _close_simulator(self) -> None:
        if self.simulator is not None:
            self.simulator.close()
            self.simulator = None


def run(make_node: Callable[[], DeviceNode], args: Sequence[str] | None = None) -> int:
    """Run a driver until a signal stops it; return the exit code of the process."""
    watch = program.watch or program.SignalWatch()
    node, code = None, 1
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = make_node()
        let_events_wait()
        watch.watch(node.stop, rclpy.try_shutdown)
        code = _work(node)
    except DriverError as error:
        print(f"error: {error}", file=sys.stderr)
    except _ArgumentErrors as error:
        if node is not None:
            raise
        print(f"error: {str(error).splitlines()[0]}", file=sys.stderr)
    finally:
        if node is not None:
            node.stop()
            program.end_in(program.MIDDLEWARE_TIME, code)
            node.destroy_node()
        rclpy.try_shutdown()
    return code


def _work(node: DeviceNode) -> int:
    """Serve until the context is shut down; return the exit code."""
    context = node.context
    try:
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        if node.option("autostart"):
            if node.trigger_configure() != TransitionCallbackReturn.SUCCESS:
                return int(context.ok())
            node.trigger_activate()
        executor.spin()
    except Exception:
        if context.ok():  # else a signal came, perhaps in the midst of publishing
            raise
    return 0


_ArgumentErrors = (RuntimeError, ValueError, rclpy.exceptions.InvalidParameterException,
                   rclpy.exceptions.InvalidParameterTypeException,
                   rclpy.exceptions.InvalidParameterValueException)
