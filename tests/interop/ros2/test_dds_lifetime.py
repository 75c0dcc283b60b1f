"""DDS nodes come and go: nothing is left behind, and nothing hangs, at any moment."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
import threading
import time

import pytest
from waiting import eventually, nothing_happens

import rosglass
from rosglass.comm import History, QoS
from rosglass.errors import Error, NodeClosedError, UnsupportedError

STRING, IMAGE = "std_msgs/msg/String", "sensor_msgs/msg/Image"
KEEP_ALL = QoS(history=History.KEEP_ALL)

pytestmark = pytest.mark.peers


#: A program that subscribes and says so, for both sides to know of each other.
READER = f"""
subscription = node.create_subscription('/big', '{IMAGE}')
while not subscription.publisher_count():
    time.sleep(0.01)
print('matched', flush=True)
time.sleep(60)
"""


def program(text: str, domain: int) -> subprocess.Popen[str]:
    """Start a program that connects to `domain` as `node`."""
    head = f"import os, sys, time, rosglass\nnode = rosglass.connect('dds://?domain={domain}')\n"
    return subprocess.Popen(
        [sys.executable, "-c", head + text],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def grown(once: str, times: int, domain: int) -> tuple[int, int, int]:
    """How much a program gains in five rounds of `once`, after two: threads, files and kilobytes.

    In a process of its own: Zenoh's threads, which earlier tests leave in this one, come and go.
    """
    text = f"""
import gc, threading
from pathlib import Path

def once():
{textwrap.indent(textwrap.dedent(once), "    ")}

for _ in range(7):
    for _ in range({times}):
        once()
    gc.collect()
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    tasks, files = os.listdir('/proc/self/task'), os.listdir('/proc/self/fd')
    print(len(tasks), len(files), pages * os.sysconf('SC_PAGE_SIZE') // 1024)
"""
    process = program(text, domain)
    output, _ = process.communicate(timeout=240)
    assert process.returncode == 0, output
    counts = [line.split() for line in output.splitlines() if line[0].isdecimal()]
    _, first, *_, last = [[int(number) for number in count] for count in counts]
    threads, files, memory = (after - before for before, after in zip(first, last, strict=True))
    return threads, files, memory


def test_a_thousand_topics_leave_nothing_behind(dds_domain):
    once = f"""
subscription = node.create_subscription('/t', '{STRING}', lambda _: None)
publisher = node.create_publisher('/t', '{STRING}')
publisher.publish(data='x')
publisher.close()
subscription.close()
"""
    threads, files, memory = grown(once, 200, dds_domain)
    # What each topic left behind would be there a thousand times.
    assert threads < 5
    assert files < 5
    assert memory < 3_000


def test_a_hundred_nodes_leave_nothing_behind(dds_domain):
    once = f"""
with rosglass.connect('dds://?domain={dds_domain}', 'brief') as brief:
    brief.create_subscription('/t', '{STRING}', lambda _: None)
    brief.create_publisher('/t', '{STRING}').publish(data='x')
"""
    threads, files, memory = grown(once, 20, dds_domain)
    assert threads < 5
    assert files < 5
    assert memory < 2_000


def test_hundreds_of_services_in_one_process_take_little_memory(dds_domain, dds_connect):
    text = """
import gc, resource
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
trigger, fibonacci = 'std_srvs/srv/Trigger', 'example_interfaces/action/Fibonacci'
for _ in range(4):
    ends = []
    for number in range(200):
        answer = lambda request, number=number: dict(success=True, message=str(number))
        ends.append(node.create_service_server(f'/s{number}', trigger, answer))
    for number in range(20):
        ends.append(node.create_action_server(f'/a{number}', fibonacci, lambda goal: dict()))
    clients = [node.create_service_client(f'/s{number}', trigger) for number in range(100)]
    texts = [client.call(timeout=60).message for client in clients]
    assert texts == [str(number) for number in range(100)], texts
    gc.collect()
    print(int(open('/proc/self/statm').read().split()[1]) * 4096, flush=True)
    sys.stdin.readline()
    for end in (*clients, *ends):
        end.close()
"""
    process = program(text, dds_domain)
    assert process.stdout is not None
    assert process.stdin is not None
    used = []
    try:
        node = dds_connect("caller")
        for _ in range(4):
            line = process.stdout.readline()
            assert line.strip().isdecimal(), line + process.stdout.read()
            used.append(int(line))
            for number in range(40):
                client = node.create_service_client(f"/s{number}", "std_srvs/srv/Trigger")
                assert client.call(timeout=60).message == str(number)
                client.close()
            print(file=process.stdin, flush=True)
        rest, _ = process.communicate(timeout=60)
        assert process.returncode == 0, rest
    finally:
        process.kill()
        process.communicate()
    assert used[0] < 150_000_000
    assert used[-1] - used[1] < 5_000_000, used


@pytest.fixture
def stuck(dds_connect, dds_domain):
    """A publisher whose only reader does not answer any more, but has not left either."""
    reader = program(READER, dds_domain)
    publisher = dds_connect("talker").create_publisher("/big", IMAGE, KEEP_ALL)
    eventually(publisher.subscription_count)
    assert reader.stdout is not None
    assert reader.stdout.readline() == "matched\n"
    reader.send_signal(signal.SIGSTOP)
    yield publisher
    reader.kill()
    reader.wait()


def test_publisher_that_waits_for_its_readers_blocks_no_thread_and_can_be_closed(stuck):
    raised: list[Error] = []
    sent = [0]

    def publish() -> None:
        try:
            while True:
                stuck.publish_serialized(data)
                sent[0] += 1
        except Error as error:
            raised.append(error)

    data = stuck.type.encode(data=bytes(300_000))
    thread = threading.Thread(target=publish, daemon=True)
    thread.start()

    def waits() -> bool:
        before = sent[0]
        nothing_happens(0.3)
        return sent[0] == before

    eventually(waits, what="the publisher to wait")
    began = time.monotonic()
    for _ in range(20):
        time.sleep(0.005)
    assert time.monotonic() - began < 3, "other threads wait, too"
    stuck.close()
    thread.join(30)
    assert not thread.is_alive()
    assert isinstance(raised[0], NodeClosedError)


def test_control_c_ends_a_program_that_waits_for_readers(dds_domain):
    text = f"""
from rosglass.comm import History, QoS
subscriber = rosglass.connect('dds://?domain={dds_domain}')
publisher = node.create_publisher('/big', '{IMAGE}', QoS(history=History.KEEP_ALL))
while not publisher.subscription_count():
    time.sleep(0.01)
print('ready', flush=True)
data = publisher.type.encode(data=bytes(300_000))
sys.stdin.readline()
print('publishing', flush=True)
while True:
    publisher.publish_serialized(data)
"""
    reader = program(READER, dds_domain)
    process = program(text, dds_domain)
    assert process.stdout is not None
    assert process.stdin is not None
    assert reader.stdout is not None
    assert process.stdout.readline() == "ready\n"
    assert reader.stdout.readline() == "matched\n"
    reader.send_signal(signal.SIGSTOP)
    print(file=process.stdin, flush=True)
    assert process.stdout.readline() == "publishing\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    reader.kill()
    reader.wait()
    assert "KeyboardInterrupt" in output
    assert process.returncode == -signal.SIGINT


def test_a_second_configuration_of_the_domain_is_refused(dds_connect, dds_domain):
    dds_connect("first")
    with pytest.raises(UnsupportedError, match="other settings"):
        rosglass.connect(f"dds://?domain={dds_domain}&range=localhost", "second")
