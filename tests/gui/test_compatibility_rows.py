"""The hand-written rows of ``docs/compatibility.md``: each has a test here, or names its tests.

Members have theirs in ``test_upstream_behaviour.py``.
"""
# ruff: noqa: E501 - tables

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from conftest import QT5
from rosglass.tf import Transform, TransformBroadcaster

ROOT = Path(__file__).parents[2]
#: Rows that state a difference without a behaviour, such as a reason.
NO_BEHAVIOUR = ["starting an interface", "`package://` in `Image.source`, `Loader.source`, imports"]
#: Names of tests by row, separated by spaces; in ``tests/gui`` where no folder is given.
TESTS = {
    # In general
    "values that do not fit a field":
        "test_conversion.py::test_both_modules_refuse_and_name"
        " test_conversion.py::test_publishing_what_does_not_fit_throws_into_javascript"
        " test_ros1_services.py::test_a_wrong_field_throws_its_path",
    "old data":
        "test_subscription.py::test_after_the_timeout test_subscription.py::test_when_the_publisher_goes"
        " test_tf.py::test_transforms_of_a_dead_robot_are_stale"
        " test_image_subscription.py::test_it_is_stale_at_once_when_the_camera_goes"
        " test_synchronized_subscription.py::test_a_set_from_before_an_outage_stays_stale",
    "shutdown and init again":
        "test_compatibility_rows.py::test_elements_work_again_after_shutdown_and_init"
        " test_action_client.py::test_the_interface_shuts_down_and_starts_again",
    "a robot that does not answer":
        "test_ros2.py::test_connecting_never_blocks"
        " test_ros1_services.py::test_the_interface_lives_while_a_call_waits"
        " test_ros1_services.py::test_calls_that_wait_within_each_other_leave_the_stop_button_alive",
    "finding packages": "test_ros1_module.py::test_packages",
    # Services
    "`Service.call()`":
        "test_ros1_services.py::test_a_call_returns_the_response"
        " test_ros1_services.py::test_the_interface_lives_while_a_call_waits",
    "result of a failed call": "test_compatibility_rows.py::test_failed_calls_are_logged_with_their_line",
    "result of an empty response":
        "test_ros1_services.py::test_an_empty_response_is_true"
        " test_compatibility_rows.py::test_an_empty_response_is_an_empty_object",
    "an unknown type": "test_ros1_services.py::test_an_unknown_type_calls_back_with_false",
    "promises": "test_services.py::test_a_client",
    "servers":
        "test_services.py::test_servers_in_the_way_of_qml6_ros2_plugin test_services.py::test_a_server"
        " test_services.py::test_a_server_answers_in_the_words_of_its_module",
    "a handler that fails": "test_services.py::test_failing_handlers_are_answered_at_once",
    "a server that is withdrawn": "test_services.py::test_servers_in_the_way_of_qml6_ros2_plugin",
    # Transforms
    "`canTransform()`":
        "test_tf.py::test_before_init_there_is_nothing_to_look_up test_tf.py::test_lookups",
    "a timeout above 0": "test_compatibility_rows.py::test_timers_run_during_a_lookup",
    "tf2's exceptions": "test_tf.py::test_waiting_for_a_transform test_tf.py::test_lookups",
    "`transformChanged`": "test_compatibility_rows.py::test_transforms_change",
    "changing a frame": "test_compatibility_rows.py::test_transforms_change",
    "`validChanged`": "test_compatibility_rows.py::test_transforms_change",
    "rotation of an unknown transform": "test_compatibility_rows.py::test_transforms_change",
    "`stale`, `age`, `timeout`":
        "test_tf.py::test_transforms_of_a_dead_robot_are_stale test_tf.py::test_following",
    "buffers": "test_tf.py::test_namespaces_are_apart test_tf.py::test_the_tree",
    "broadcasting": "test_tf.py::test_broadcasting",
    # Values, times, arrays, files
    "R1 durations: number of ms": "test_times.py::test_durations_of_ros1_are_milliseconds",
    "`add`, `subtract`, `multiply`, `compare`, `equals`, `lessThan`, `greaterThan`, "
    "`exactNanoseconds()`, `<`, `>`":
        "test_times.py::test_arithmetic_is_exact test_times.py::test_today_is_exact_too",
    "`Ros2.time(...)`, `Ros2.duration(...)`, `Ros.time(...)`, `Ros.duration(...)`":
        "test_times.py::test_times_can_be_made test_times.py::test_the_singletons_of_ros1",
    "`Array`: `length` rw, `at`, `spliceList`, `push`, `pop`, `shift`, `unshift`, `toArray`, "
    "`toVariantList`, `append`, `replace`":
        "test_arrays.py::test_arrays_change test_arrays.py::test_removed_elements_are_returned",
    "`Array.replace(i, v)` beyond the end": "test_arrays.py::test_arrays_change",
    "`Array.buffer()`":
        "test_arrays.py::test_wide_integers_have_exact_buffers"
        " test_arrays.py::test_typed_arrays_and_buffers_fit",
    "createEmpty* arrays": "test_arrays.py::test_empty_messages_have_the_same_arrays",
    "`constants(type)`, `documentation(type)`":
        "test_value_functions.py::test_constants test_value_functions.py::test_documentation"
        " test_value_functions.py::test_unknown_types_throw",
    "publish, goals, requests that do not fit":
        "test_conversion.py::test_publishing_what_does_not_fit_throws_into_javascript"
        " test_action_client.py::test_misuse_throws test_ros1_actions.py::test_misuse_throws"
        " test_services.py::test_a_client",
    "missing or undefined field": "test_values.py::test_values_fit",
    "unknown field":
        "test_values.py::test_invalid_value_is_named"
        " test_conversion.py::test_properties_and_objects_of_qml_are_messages",
    "`Header.seq` from `Ros 1.0` to a ROS 2 robot":
        "test_times.py::test_headers_of_ros1_can_be_sent_to_ros2"
        " test_times.py::test_the_counter_of_ros1_headers_is_there",
    "Date, QVector2D/3D/4D, QQuaternion, QML objects, ListModel and other item models, lists of C++":
        "test_conversion.py::test_both_modules_take test_conversion.py::test_nested_objects_of_qml"
        " test_conversion.py::test_urls_are_texts test_conversion.py::test_item_models_are_arrays"
        " test_conversion.py::test_item_models_of_python_are_arrays",
    "time in ms as a number (scalar)": "test_values.py::test_times_take_dates_and_milliseconds",
    "{sec,nsec}, {sec,nanosec}, {secs,nsecs}, {nanoseconds}":
        "test_times.py::test_times_of_both_modules_are_taken",
    "R2: string for number, number for string, 0/1 for bool, bool for number":
        "test_conversion.py::test_ros2_takes_texts_for_numbers_where_nothing_is_lost"
        " test_conversion.py::test_both_modules_refuse_and_name",
    "number for string[]": "test_conversion.py::test_texts_in_arrays_take_numbers",
    "elements that do not fit; too long or too short for a fixed or bounded array":
        "test_arrays.py::test_value_of_a_wrong_type_is_named",
    "errors inside elements of compound arrays":
        "test_conversion.py::test_both_modules_refuse_and_name",
    "fields that were renamed between ROS 1 and 2 (`CameraInfo.K`/`k`)":
        "test_times.py::test_fields_that_ros2_renamed_answer_to_the_name_of_the_module",
    "`io.readYaml`, `io.writeYaml`":
        "test_yaml_io.py::test_values_come_back"
        " test_yaml_io.py::test_relative_paths_start_at_the_working_directory"
        " test_yaml_io.py::test_files_that_make_no_sense_are_refused"
        " test_yaml_io.py::test_unwritable_value_leaves_the_file_alone",
    'R2 map with `type: "time"` but no `sec`': "test_yaml_io.py::test_values_come_back",
    "yaml `y`, `n`": "test_yaml_io.py::test_files_of_others_are_read",
    "`MessageItemModel`: `message`, `messageType`, `modified()`, roles `display`, `type`, "
    "`treeIndex`, `isArrayElement`, `insertRows`, `removeRows`":
        "test_message_item_model.py::test_the_tree_of_a_message"
        " test_message_item_model.py::test_arrays_and_their_elements"
        " test_message_item_model.py::test_the_tree_index_is_the_row"
        " test_message_item_model.py::test_elements_can_be_edited_inserted_and_removed",
    "`MessageItemModel`: role `edit`": "test_message_item_model.py::test_only_values_have_an_edit_role",
    "`MessageItemModel.message` set again":
        "test_message_item_model.py::test_new_messages_of_the_same_type_keep_the_tree",
    # Cameras
    "`topic`": "test_image_views.py::test_the_namespace_of_ros_1",
    "`ns` (Ros 1.0)": "test_compatibility_rows.py::test_cameras_of_two_namespaces_are_apart",
    "`defaultTransport`":
        "test_image_subscription.py::test_the_preferred_transport_wins_as_soon_as_it_is_there"
        " test_image_subscription.py::test_unusable_topic_is_a_problem",
    "`subscribed`": "test_image_views.py::test_rarely_wanted_images_are_fetched_one_by_one",
    "`videoSurface`": "test_video_output.py::test_every_encoding_shows_the_right_colours",
    "`videoSink`": "test_image_subscription.py::test_raw_images_are_shown",
    "`networkLatency`, `processingLatency`, `latency`":
        "test_image_subscription.py::test_rate_and_latency_are_not_rounded",
    "`framerate`": "test_image_subscription.py::test_rate_and_latency_are_not_rounded",
    "`timeout`":
        "test_image_views.py::test_throttled_images_do_not_time_out_between_their_turns"
        " test_image_subscription.py::test_without_timeout_it_stays_but_is_stale",
    "`throttleRate`": "test_image_views.py::test_one_viewer_that_wants_all_gets_all",
    "`enabled`, `play()`, `stop()`": "test_image_views.py::test_stop_takes_it_off_the_screen",
    "`playbackState`": "test_image_views.py::test_the_states_have_names",
    "`pause()`": "test_image_views.py::test_pause_keeps_the_image_and_says_that_it_is_old",
    "`encoding`, `hasAlpha`, `isColor`": "test_image_subscription.py::test_raw_images_are_shown",
    "sharing": "test_image_subscription.py::test_all_viewers_share_one_stream",
    "load balancing": "test_image_views.py::test_rarely_wanted_images_are_fetched_one_by_one",
    "`ImageTransportManager.setLoadBalancingEnabled(bool)`":
        "test_image_views.py::test_without_load_balancing_the_rest_is_not_decoded",
    "repeated stamps while throttled": "test_image_views.py::test_repeated_image_is_not_a_new_one",
    "32FC1":
        "unit/images/test_encodings.py::test_depth_in_metres_becomes_millimetres"
        " unit/images/test_depth.py::test_gray_from_0_to_1_is_the_scaling_of_qml_ros_plugin",
    "encodings":
        "unit/images/test_encodings.py::test_every_encoding_has_a_test"
        " unit/images/test_encodings.py::test_byte_order_is_honoured"
        " unit/images/test_encodings.py::test_bayer_patterns",
    "unsupported encoding":
        "test_image_subscription.py::test_bad_images_are_named_once_and_the_stream_goes_on",
    "queue size in the sharing key":
        "test_image_subscription.py::test_the_newest_wins_and_drops_are_counted",
    "new":
        "test_image_views.py::test_turned_mirrored_cut test_image_views.py::test_shown_image_is_saved"
        " test_image_views.py::test_snapshot_errors_are_reported"
        " test_image_views.py::test_near_and_far_have_different_colors_and_unknown_is_black",
    "reduction": "test_image_views.py::test_large_image_is_reduced_until_it_is_needed_whole",
    # Qt 5 and Qt 6
    "all elements, singletons, values, promises, actions, times, arrays":
        "test_upstream_behaviour.py::test_members_answer_as_in_the_reference",
    "`VideoOutput { source: sub }` from `Ros`/`Ros2`, or Qt 5's own":
        "test_video_output.py::test_every_encoding_shows_the_right_colours",
    "`sub.videoSink: output.videoSink`":
        "test_compatibility_rows.py::test_qt5_knows_the_rest_of_javascript_and_no_video_sink",
    "images in VideoOutput": "test_video_output.py::test_every_encoding_shows_the_right_colours",
    "VideoOutput with software rendering":
        "test_video_output.py::test_a_turned_output_looks_the_same_with_every_renderer",
    "imports without a version": "test_compatibility_rows.py::test_qt5_refuses",
    "`Window`": "test_compatibility_rows.py::test_qt5_refuses",
    "JavaScript":
        "test_compatibility_rows.py::test_qt5_refuses"
        " test_compatibility_rows.py::test_qt5_knows_the_rest_of_javascript_and_no_video_sink",
    "`length` of arrays of more than 65536 numbers or texts, or 1024 messages":
        "test_compatibility_rows.py::test_qml_files_see_the_length_of_long_arrays",
    "offscreen": "test_run.py::test_offscreen_without_any_display",
    "an engine without install()":
        "test_ros2.py::test_an_engine_that_was_not_prepared_says_what_to_do",
    "demo cockpit": "test_compatibility_rows.py::test_demo_needs_qt6",
    # Actions
    "`Ros2.createActionClient(name, type)`":
        "test_action_client.py::test_the_type_is_the_servers test_action_client.py::test_misuse_throws",
    "`ActionClient.ready`, `serverReadyChanged`, `isServerReady()`":
        "test_action_client.py::test_the_robot_goes_away",
    "`name`, `type`, `actionType`, `connectionTimeout`":
        "test_action_client.py::test_a_goal test_action_client.py::test_no_server",
    "`sendGoalAsync(goal, {onGoalResponse, onFeedback, onResult})`":
        "test_action_client.py::test_misuse_throws",
    "`onGoalResponse(handle or null)`":
        "test_action_client.py::test_a_goal test_action_client.py::test_no_server",
    "`onFeedback(handle, feedback)`": "test_action_client.py::test_a_goal",
    "`onResult({goalId, code, result})`":
        "test_action_client.py::test_an_aborted_and_a_rejected_goal"
        " test_action_client.py::test_no_server"
        " test_action_client.py::test_goal_of_a_lost_server_ends",
    "`sendGoal(goal)`": "test_action_client.py::test_promises",
    "`cancelAllGoals()`, `cancelGoalsBefore(Time or Date)`":
        "test_action_client.py::test_cancelling_all test_action_client.py::test_cancelling_until_a_time"
        " test_action_client.py::test_failed_cancel_is_reported",
    "`GoalHandle.status`, `statusChanged(status)`":
        "test_action_client.py::test_a_goal test_action_client.py::test_goals_leave_nothing_behind",
    "`GoalHandle.goalId`": "test_action_server.py::test_a_handle",
    "`GoalHandle.goalStamp`, `isActive`, `cancel()`":
        "test_action_client.py::test_a_goal"
        " test_action_client.py::test_a_goal_taken_back_before_there_is_a_server"
        " test_action_client.py::test_failed_cancel_is_reported",
    "`GoalHandle.feedback`, `result`, `reason`": "test_action_client.py::test_a_goal",
    "identity of handles": "test_ros1_actions.py::test_a_goal test_action_client.py::test_a_goal",
    "`ActionGoalStatus`": "test_upstream_behaviour.py::test_enumerators_have_the_numbers_of_ros",
    "`Ros.createActionClient([ns,] type, name)`":
        "test_ros1_actions.py::test_names_within_a_namespace",
    "`ActionClient.connected`, `connectedChanged`":
        "test_ros1_actions.py::test_connected_follows_the_server",
    "`ActionClient.actionType`": "test_ros1_actions.py::test_a_goal",
    "`isServerConnected()`": "test_ros1_actions.py::test_a_goal",
    "`sendGoal(goal, transition_cb, feedback_cb)`":
        "test_ros1_actions.py::test_a_goal test_ros1_actions.py::test_misuse_throws",
    "`cancelAllGoals()`": "test_ros1_actions.py::test_cancelling",
    "`cancelGoalsAtAndBeforeTime(Date)`": "test_ros1_actions.py::test_cancelling",
    "`transition_cb(handle)` on every change of `commState`":
        "test_ros1_actions.py::test_a_goal test_ros1_actions.py::test_cancelling",
    "`GoalHandle.expired`, `terminalState {state, text}`, `commState`, `getResult()`":
        "test_ros1_actions.py::test_a_goal test_ros1_actions.py::test_the_interface_shuts_down",
    "`terminalState.state` before `DONE`": "test_ros1_actions.py::test_a_goal",
    "`GoalHandle.cancel()`, `resend()`":
        "test_ros1_actions.py::test_cancelling test_ros1_actions.py::test_a_goal",
    "`ActionCommStates`, `ActionTerminalStates`":
        "test_upstream_behaviour.py::test_enumerators_have_the_numbers_of_ros",
    "`Ros 1.0` with a ROS 2 robot, `Ros2 1.0` with a ROS 1 robot":
        "test_ros1_actions.py::test_a_goal test_action_client.py::test_a_goal",
    "`ActionServer` with `handleGoal`, `handleCancel`, `goalAccepted`":
        "test_action_server.py::test_a_server_in_the_way_of_qml6_ros2_plugin"
        " test_action_server.py::test_without_handle_cancel_a_cancel_is_refused",
    "a handler of `goalAccepted` that throws, or is missing":
        "test_action_server.py::test_goals_that_no_handler_ends_are_aborted_at_once",
    "`ActionServer` with `accept`, `execute`, `cancel`, `Ros2.createActionServer()`, "
    "`Ros.advertiseAction()`":
        "test_action_server.py::test_servers_of_functions test_action_server.py::test_ros1_servers",
    # The runner
    "`ros_qml`'s arguments: `qml_url`, `qml_description` parameters":
        "test_runner.py::test_import_paths_and_packages test_runner.py::test_several_windows"
        " test_runner.py::test_roots_may_change_between_item_and_window",
    "SIGINT":
        "test_run_ending.py::test_a_blocked_call_is_given_up_on_a_signal"
        " test_run.py::test_ctrl_c_ends_an_interface_that_hangs",
    "SIGTERM, closing the last window, `Qt.exit(code)`":
        "test_run.py::test_signals_end_it test_run.py::test_closing_windows_ends_it"
        " test_run.py::test_arguments_exit_codes_and_runtime_warnings",
    "live reload (qml_rviz / `QmlOverlay`)":
        "test_runner.py::test_reload_keeps_the_node_and_collects_the_old_interface"
        " test_runner.py::test_errors_are_shown_over_the_last_good_interface"
        " test_runner.py::test_a_reload_is_deferred_while_a_call_waits"
        " rviz/test_reload.py::test_hidden_overlays_reload_when_they_are_visible_again"
        " rviz/test_reload.py::test_reloads_however_an_editor_saves",
    "import paths": "test_runner.py::test_import_paths_and_packages",
    "`package://` in FILE and `-I`": "test_runner.py::test_import_paths_and_packages",
    "kiosk mode": "test_runner.py::test_a_kiosk_stays_open_and_hides_the_pointer",
    "`.qmltypes`":
        "test_qmltypes.py::test_the_descriptions_are_those_of_the_types"
        " test_qmltypes.py::test_an_editor_knows_the_types",
    # Publishing images, recordings, synchronization
    "`ImagePublisher`": "test_image_publisher.py::test_a_panel_as_images",
    "`Replay`, `replay:` URLs":
        "test_replay.py::test_watching_a_recording_instead_of_the_robot"
        " test_replay.py::test_from_the_command_line",
    "`SynchronizedSubscription`":
        "test_synchronized_subscription.py::test_matching_messages_arrive_together",
    "`Publisher.problem`":
        "test_qos.py::test_a_profile_that_clashes_is_a_problem_on_both_sides"
        " test_replay.py::test_publishing_during_replay_is_a_problem",
    # Profiles
    "`QoS.deadlineMs`, `lifespanMs`, `leaseMs`, `sendTimeoutMs`, `liveliness`":
        "test_qos.py::test_every_policy_can_be_read test_qos.py::test_graph_shows_every_policy",
    # The object rviz: the same tests run over RViz and over a SceneView.
    "`rviz.config`": "helpers/overlay_contract.py::test_registered_properties_and_config"
        " rviz/test_properties.py::test_config_keeps_what_a_file_can",
    "`rviz.visible`": "helpers/overlay_contract.py::test_the_overlay_and_the_window",
    "`rviz.isFullscreen`": "rviz/test_application.py::test_full_screen",
    "`rviz.fixedFrame`": "helpers/overlay_contract.py::test_the_fixed_frame_is_reported",
    "`rviz.toolManager`: `tools`, `currentTool`, `addTool()`, `addTool(classId)`, `getTool`, "
    "`removeTool`, `removeAll`, `toolAdded`, `toolChanged`, `toolsChanged`":
        "helpers/overlay_contract.py::test_tools rviz/test_tools.py::test_the_dialog_for_a_new_tool",
    "`toolRemoved`": "helpers/overlay_contract.py::test_tools",
    "`toolManager.addTool(classId)` of an unknown class":
        "helpers/overlay_contract.py::test_wrong_tools_are_refused",
    "`toolManager.toolClasses`": "helpers/overlay_contract.py::test_tools",
    "`QmlTool`: `isSelected`, `shortcutKey`, `name`, `description`, `classId`, `iconSource`":
        "helpers/overlay_contract.py::test_tools rviz/test_tools.py::test_tools_of_one_name",
    "`QmlTool.accessAllKeys`, `tool`": "helpers/overlay_contract.py::test_tools",
    "`image://rviz_tool_icons/<classId>`": "helpers/overlay_contract.py::test_tool_icons",
    "`rviz.createPositionTracker(x, y, z)`, `position`, `positionChanged(position)`":
        "helpers/overlay_contract.py::test_position_trackers",
    "its `point`, `frame`, `problem`":
        "helpers/overlay_contract.py::test_position_trackers"
        " helpers/overlay_contract.py::test_trackers_of_frames",
    "`rviz.register...Property`":
        "helpers/overlay_contract.py::test_registered_properties_and_config"
        " rviz/test_properties.py::test_registering_again_returns_the_same",
    "`rviz.pick`, `displays`, `display`, `addDisplay`, `removeDisplay`, `getProperty`, "
    "`setProperty`, `loadConfig`, `saveConfig`, `view`, `screenshot`, `frameRate`, `status`":
        "helpers/overlay_contract.py::test_picking helpers/overlay_contract.py::test_screenshots"
        " helpers/overlay_contract.py::test_displays_are_added_and_removed"
        " helpers/overlay_contract.py::test_properties_are_read_and_written"
        " helpers/overlay_contract.py::test_configs",
}  # fmt: skip


class Probe(NamedTuple):
    """An expression in JavaScript and its value."""

    module: str
    code: str
    value: Any


INTS = "Ros2.createEmptyMessage('std_msgs/Int32MultiArray').data"
WAIT = """(ms => {
    try { MODULE.waitForMessageAsync('/x', ms, () => {}); return 'waits' }
    catch (e) { return e.message.slice(-3) }
})"""
#: Probes by row.
PROBES = {
    # In general
    "functions read as properties (`var f = Ros2.info`)": [
        Probe("Ros2", "(f => { f('read'); return typeof f })(Ros2.info)", "function"),
        Probe("Ros", "(f => { f('read'); return typeof f })(Ros.info)", "function"),
    ],
    "names of uncreatable types (`ActionClient`, `GoalHandle`, `NodeHandle`, `Publisher`, "
    "`Ros2InitOptions`, `ServiceClient`, `TopicInfo`)": [
        Probe("Ros2", "[typeof ActionClient, typeof GoalHandle, typeof Publisher,"
                      " typeof Ros2InitOptions, typeof ServiceClient, typeof TopicInfo]",
              ["undefined"] * 6),
        Probe("Ros", "[typeof ActionClient, typeof GoalHandle, typeof NodeHandle, typeof Publisher,"
                     " typeof TopicInfo]", ["undefined"] * 5),
    ],
    "`NodeHandle`": [Probe("Ros", "typeof NodeHandle", "undefined")],
    "threads": [Probe("Ros", "[Ros.setThreads(2), Ros.spinOnce()].every(r => r === undefined)", True)],
    # Values, times, arrays, files
    "message values: objects": [
        Probe("Ros2", "(m => [m.pose === m.pose, m.pose.position.x = 3, m.pose.position.x])"
                      "(Ros2.createEmptyMessage('geometry_msgs/PoseStamped'))", [True, 3, 3]),
        Probe("Ros2", "Ros2.createEmptyMessage('sensor_msgs/BatteryState').POWER_SUPPLY_STATUS_FULL", 4),
    ],
    "`#messageType` (R2)": [
        Probe(module, f"(m => [m['#messageType'], Object.keys(m), JSON.stringify(m)])"
                      f"({module}.createEmptyMessage('geometry_msgs/Point'))",
              [name, ["x", "y", "z"], '{"x":0,"y":0,"z":0}'])
        for module, name in (("Ros", "geometry_msgs/Point"), ("Ros2", "geometry_msgs/msg/Point"))
    ],
    "int64, uint64": [
        Probe("Ros2", "(t => [typeof BigInt, t.exactNanoseconds()])(Ros2.time({nanoseconds: '9007199254740993'}))",
              ["undefined", "9007199254740993"]),
    ],
    "R1 `Time` value: `sec`, `nsec`, `toSec()`, `toNSec()`, `isZero()`, `toJSDate()`": [
        Probe("Ros", "(t => [t.sec, t.nsec, t.toSec(), t.toNSec(), t.isZero(), t.toJSDate().getTime(),"
                     " t.exactNanoseconds()])(Time.create(1700000000, 123456789))",
              [1700000000, 123456789, 1700000000.123456789, 1700000000123456800, False,
               1700000000123, "1700000000123456789"]),
    ],
    "R2/6 `Time`: `sec`, `nanosec`, `seconds()`, `nanoseconds()`, `clockType()`, `isZero()`, "
    "`toJSDate()`": [
        Probe("Ros2", "(t => [t.sec, t.nanosec, t.seconds(), t.nanoseconds(), t.isZero(),"
                      " t.toJSDate().getTime()])(Ros2.time(1.5))", [1, 5e8, 1.5, 1.5e9, False, 1500]),
        Probe("Ros2", "(t => [t.clockType() === Ros2ClockTypes.Ros, t.clockType === t.clockType(),"
                      " t.clockType() == 1, t.clockType() === 1, Number(t.clockType())])(Ros2.now())",
              [True, True, True, False, 1]),
    ],
    "R2/5 `Time.seconds`, `.nanoseconds`, `.clockType` as properties": [
        Probe("Ros2", "(t => [t.seconds * 2, t.seconds < 5, t.seconds.toFixed(1), `${t.seconds}`,"
                      " t.nanoseconds + 1, t.seconds === 1.5, t.seconds() === 1.5,"
                      " t.clockType === Ros2ClockTypes.Ros])(Ros2.time(1.5))",
              [3, True, "1.5", "1.5", 1500000001, False, True, True]),
    ],
    "R2 `Duration`: likewise, `toJSDuration()`": [
        Probe("Ros2", "(t => [t.sec, t.nanosec, t.seconds(), t.nanoseconds(), t.seconds * 2,"
                      " t.isZero(), t.toJSDuration()])(Ros2.duration(1.5))",
              [1, 5e8, 1.5, 1.5e9, 3, False, 1500]),
    ],
    "assigning `sec` of a time inside a message": [
        Probe(module, f"(m => {{ m.header.stamp.sec = 7; return m.header.stamp.sec }})"
                      f"({module}.createEmptyMessage('geometry_msgs/PoseStamped'))", 7)
        for module in ("Ros", "Ros2")
    ],
    "R1 `Time.now()`, `create(seconds)`, `create(sec, nsec)`, `isSimTime()`, `isSystemTime()`, "
    "`isValid()`; `WallTime.now()`, `create`": [
        Probe("Ros", "(() => { try { return Time.create('x') } catch (e) { return 'thrown' } })()", "thrown"),
        Probe("Ros", "[Time.isSimTime(), Time.isSystemTime(), Time.isValid(), Time.create(1.5).nsec,"
                     " WallTime.create(3, 4).nsec, Time.now().isZero()]",
              [False, True, True, 500000000, 4, False]),
    ],
    "`Array.at(-1)`": [Probe("Ros2", f"(a => {{ a.push(1, 2); return a.at(-1) }})({INTS})", 2)],
    "`Array.length = n` growing": [
        Probe("Ros2", f"(a => {{ a.length = 64; return [a[1] === undefined, a.at(1), a.toArray()[1],"
                      f" new Int32Array(a.buffer())[1], a.length] }})({INTS})", [True, 0, 0, 0, 64]),
    ],
    "copies of an array": [
        Probe("Ros2", f"(a => {{ const b = a; b.push(1); return [a.length, a === b] }})({INTS})", [1, True]),
        Probe("Ros2", f"(a => {{ a.push(1); return {INTS}.length }})({INTS})", 0),
    ],
    "`createEmptyMessage`, `createEmptyServiceRequest`, `createEmptyActionGoal`": [
        Probe("Ros", "[Ros.createEmptyActionGoal('actionlib_tutorials/FibonacciAction'),"
                     " Ros.createEmptyServiceRequest('std_srvs/SetBool'),"
                     " Ros.createEmptyMessage('std_msgs/msg/Bool')]",
              [{"order": 0}, {"data": False}, {"data": False}]),
        Probe("Ros2", "['Message', 'ServiceRequest', 'ActionGoal']"
                      ".map(n => Ros2['createEmpty' + n]('no_msgs/None') === undefined)", [True] * 3),
    ],
    "empty messages in R2": [
        Probe("Ros2", "[Ros2.createEmptyMessage('std_msgs/Empty'),"
                      " Ros2.createEmptyServiceRequest('std_srvs/Trigger')].map(Object.keys)", [[], []]),
    ],
    "`Ros2ClockTypes`": [
        Probe("Ros2", "[Ros2ClockTypes.Ros == 1, Ros2ClockTypes.Ros === 1, Number(Ros2ClockTypes.Steady)]",
              [True, False, 3]),
    ],
    # Profiles
    "`QoS` `reliable()` ... `keep_all()`, `depth()`": [
        Probe("Ros2", "(q => [q.reliable().reliability, q.best_effort().reliability,"
                      " q.transient_local().durability, q.durability_volatile().durability,"
                      " q.keep_last(3).depth(), q.keep_all().history])(Ros2.QoS())",
              ["reliable", "best_effort", "transient_local", "volatile", 3, "keep_all"]),
        Probe("Ros2", "(q => [q.reliable() === q, q.reliability])(Ros2.QoS())", [True, "reliable"]),
    ],
    "`QoS.deadline()`, `lifespan()`, `send_timeout()`, `liveliness_automatic()`, "
    "`liveliness_manual_by_topic()`, `liveliness_lease_duration()`, `best_available()`, "
    "`reliability_system_default()`, `durability_system_default()`": [
        Probe("Ros2", "(q => [q.deadline(1).deadlineMs, q.lifespan(2).lifespanMs,"
                      " q.send_timeout(3).sendTimeoutMs, q.liveliness_lease_duration(4).leaseMs,"
                      " q.liveliness_manual_by_topic().liveliness, q.liveliness_automatic().liveliness,"
                      " q.best_available().reliability, q.reliability_system_default().reliability,"
                      " q.durability_system_default().durability])(Ros2.QoS())",
              [1, 2, 3, 4, "manual_by_topic", "automatic", "best_available"] + ["system_default"] * 2),
    ],
    "`waitForMessageAsync(topic, milliseconds, ...)`": [
        Probe(module, f"[NaN, Infinity, 0, 1e12].map({WAIT.replace('MODULE', module)})",
              ["NaN", "waits", "waits", "waits"])
        for module in ("Ros", "Ros2")
    ],
    "arrays: `replace(i, v)`, `length = n`": [
        Probe("Ros2", "[a => a.replace(2 ** 24, 1), a => { a.length = 2 ** 24 + 1; a.toArray() },"
                      " a => { a.length = 2 ** 24 + 1; a.toVariantList() },"
                      " a => { a.length = 2 ** 24 + 1; a.buffer() }]"
                      f".map(f => {{ try {{ f({INTS}) }} catch (e) {{ return e.name }} }})",
              ["RangeError"] * 4),
    ],
}  # fmt: skip


def rows() -> list[str]:
    """Return the first cells of the rows that are written by hand."""
    page = (ROOT / "docs" / "compatibility.md").read_text(encoding="utf-8")
    page = page.partition("<!-- members -->")[0]
    cells = [line[2:].partition(" | ")[0] for line in page.splitlines() if line.startswith("| ")]
    return [cell for cell in cells if cell not in ("topic", "member", "member or topic")]


def test_every_row_has_a_test() -> None:
    assert sorted(rows()) == sorted([*TESTS, *PROBES, *NO_BEHAVIOUR])


def test_the_named_tests_exist() -> None:
    missing = []
    for place in sorted({place for text in TESTS.values() for place in text.split()}):
        file, _, test = place.partition("::")
        folder = "" if "/" in file else "gui"
        text = (ROOT / "tests" / folder / file).read_text(encoding="utf-8")
        if not re.search(rf"def {test}\(", text):
            missing.append(place)
    assert missing == []


@pytest.mark.both_qt
@pytest.mark.parametrize("row", PROBES)
def test_rows_are_true(running: Any, row: str) -> None:
    for probe in PROBES[row]:
        running.module = f"{probe.module} 1.0"
        assert running.run(f"return {probe.code}") == probe.value, probe.code


@pytest.mark.parametrize("module", ["Ros", "Ros2"])
def test_functions_can_be_read_before_init(bench: Any, module: str) -> None:
    bench.module = f"{module} 1.0"
    assert bench.run(f"const f = {module}.info; f('early'); return typeof f") == "function"


@pytest.mark.both_qt
def test_elements_work_again_after_shutdown_and_init(bench: Any, wait: Any) -> None:
    calls = []

    def switch(request: Any) -> dict[str, Any]:
        calls.append(request.data)
        return {"success": True}

    bench.robot.create_service_server("/lamp", "std_srvs/srv/SetBool", switch)
    commands: list[Any] = []
    bench.robot.create_subscription("/out", "std_msgs/msg/String", commands.append)
    chat = bench.robot.create_publisher("/chat", "std_msgs/msg/String")
    ours = bench.robot.create_service_client("/ours", "std_srvs/srv/Trigger")
    root: Any = bench.load("""QtObject {
        property Subscription sub: Subscription { topic: "/chat" }
        property var pub: Ros2.createPublisher("/out", "std_msgs/msg/String")
        property var client: Ros2.createServiceClient("/lamp", "std_srvs/srv/SetBool")
        property ServiceServer server: ServiceServer {
            name: "/ours"; type: "std_srvs/srv/Trigger"; handler: () => ({message: "ours"})
        }
        property TfTransform tf: TfTransform { sourceFrame: "base"; targetFrame: "map" }
        property bool answered: false
        function ready() {
            return [sub.subscribed, pub.isAdvertised, client.ready, server.advertised].join()
        }
        function heard() { return sub.message ? sub.message.data : "" }
        function say(text) { pub.publish({data: text}) }
        function call(on) { client.sendRequestAsync({data: on}, r => answered = r.success) }
        function valid() { return tf.valid }
    }""")
    broadcaster = TransformBroadcaster(bench.robot)
    for text in ("first", "second"):
        bench.session.init("ui")
        wait(lambda: root.ready() == "true,true,true,true", root.ready)
        wait(chat.subscription_count)
        chat.publish(data=text)
        wait(lambda text=text: root.heard() == text)
        root.say(text)
        wait(lambda text=text: commands and commands[-1].data == text)
        root.setProperty("answered", False)
        root.call(text == "first")
        wait(lambda: root.property("answered"))
        served = ours.call_async({}, timeout=20)
        wait(served.done)
        assert served.result().message == "ours"
        wait(
            lambda: (
                broadcaster.send_transform(Transform(frame_id="map", child_frame_id="base"))
                or root.valid()
            )
        )
        bench.session.shutdown()
        assert root.ready() == "false,false,false,false"
        wait(lambda: not root.valid())
    assert calls == [True, False]


def test_failed_calls_are_logged_with_their_line(bench: Any, caplog: Any) -> None:
    bench.module = "Ros 1.0"
    assert bench.run("\n\nreturn Service.call('/lamp', 'std_srvs/Trigger', {})") is False
    record = next(r for r in caplog.records if "/lamp" in r.getMessage())
    assert record.pathname.endswith(".qml")
    assert record.lineno == 6


@pytest.mark.both_qt
def test_an_empty_response_is_an_empty_object(running: Any, wait: Any) -> None:
    running.robot.create_service_server("/reset", "std_srvs/srv/Empty", lambda request: None)
    root: Any = running.load("""QtObject {
        property var client: Ros2.createServiceClient("/reset", "std_srvs/srv/Empty")
        property string answer
        Component.onCompleted: client.sendRequestAsync({}, r => answer = JSON.stringify(r))
    }""")
    wait(lambda: root.property("answer") == "{}")


@pytest.mark.both_qt
def test_timers_run_during_a_lookup(running: Any) -> None:
    root: Any = running.load("""QtObject {
        property int ticks: 0
        property Timer timer: Timer { interval: 5; repeat: true; running: true; onTriggered: ticks += 1 }
        function look() { return TfTransformListener.canTransform("map", "moon", 0, 300) }
    }""", "import QtQuick 2.15")  # fmt: skip
    assert "moon" in root.look()
    assert root.property("ticks") > 0


@pytest.mark.both_qt
def test_transforms_change(running: Any, wait: Any) -> None:
    running.module = "Ros 1.0"
    root: Any = running.load("""QtObject {
        property int changes: 0
        property var log: []
        property TfTransform tf: TfTransform {
            sourceFrame: "base"; targetFrame: "map"
            onValidChanged: log.push(valid === message.valid)
        }
        property Connections c: Connections {
            target: TfTransformListener
            function onTransformChanged() { changes += 1 }
        }
        function rotation() { return [tf.rotation.x, tf.rotation.y, tf.rotation.z, tf.rotation.w].join() }
        function follow(frame) { tf.sourceFrame = frame }
        function x() { return tf.translation.x }
        function valid() { return tf.valid }
        function events() { return log.join() }
    }""")  # fmt: skip
    assert root.rotation() == "0,0,0,1"
    broadcaster = TransformBroadcaster(running.robot)
    wait(lambda: running.robot.publishers("/tf") and running.robot.subscriptions("/tf"))
    broadcaster.send_transform(
        [
            Transform((x, 0.0, 0.0), frame_id="map", child_frame_id=frame)
            for x, frame in ((1.0, "base"), (2.0, "arm"), (3.0, "hand"))
        ]
    )
    wait(root.valid)
    wait.settled(running.session)
    assert root.property("changes") == 1
    assert root.events() == "true"
    # The new one is shown without another message.
    root.follow("arm")
    wait(lambda: root.x() == 2)
    assert root.property("changes") == 1


def test_cameras_of_two_namespaces_are_apart(running: Any, wait: Any) -> None:
    running.module = "Ros 1.0"
    for arm in ("left", "right"):
        running.robot.create_publisher(f"/{arm}/cam", "sensor_msgs/msg/Image")
    running.load("""Item {
        ImageItem { source: ImageTransportSubscriber { ns: "left"; topic: "cam" } }
        ImageItem { source: ImageTransportSubscriber { ns: "right"; topic: "cam" } }
    }""", "import QtQuick 2.15")  # fmt: skip
    wait(
        lambda: sorted(s.topic for s in running.world.subscriptions) == ["/left/cam", "/right/cam"]
    )


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("imports", "body", "reason"),
    [
        ("import QtQuick", "Item {}", "requires a version"),
        ("import QtQuick 2.15", "Window {}", "Window is not a type"),
        ("", "QtObject { property var v: Qt?.x }", "Unexpected token|Expected token"),
        ("", "QtObject { property int n: 1_000 }", "Unexpected token|Expected token"),
    ],
)
def test_qt5_refuses(bench: Any, imports: str, body: str, reason: str) -> None:
    if not QT5:
        bench.load(body, imports)
        return
    with pytest.raises(AssertionError, match=reason):
        bench.load(body, imports)


@pytest.mark.both_qt
@pytest.mark.skipif(not QT5, reason="it runs with Qt 6: see test_demo_command.py")
def test_demo_needs_qt6(start: Any) -> None:
    program = start("demo", "--seconds", "2")
    assert program.end() == 1
    assert "the demo's cockpit needs Qt 6" in program.text
    assert "robot" not in program.text.replace("rosglass robot", "")


@pytest.mark.both_qt
def test_qt5_knows_the_rest_of_javascript_and_no_video_sink(bench: Any) -> None:
    known = "[null ?? 2, typeof Promise, typeof Proxy, [...[1, 2]].length, typeof class {}]"
    assert bench.run(f"return {known}") == [2, "function", "function", 2, "function"]
    root: Any = bench.load(
        """Item {
            VideoOutput { id: output }
            function has_sink() { return Boolean(output.videoSink) }
        }""",
        "import QtQuick 2.15\nimport QtMultimedia 5.15"
        if QT5
        else "import QtQuick\nimport QtMultimedia",
    )
    assert root.has_sink() is not QT5


@pytest.mark.both_qt
@pytest.mark.parametrize("count", [65536, 65537])
def test_qml_files_see_the_length_of_long_arrays(running: Any, wait: Any, count: int) -> None:
    scan = running.robot.create_publisher("/scan", "sensor_msgs/msg/LaserScan")
    root: Any = running.load("""QtObject {
        property var sub: Subscription { topic: "/scan" }
        function lengths() {
            const m = sub.message
            if (!m) return ""
            let n = 0
            for (const x of m.ranges) n += 1
            return [m.ranges.length, m.ranges.toArray().length, n,
                    m.ranges.buffer().byteLength / 4].join()
        }
    }""")  # fmt: skip
    wait(scan.subscription_count)
    scan.publish(ranges=[1.0] * count)
    shown = 0 if QT5 and count > 65536 else count
    wait(lambda: root.lengths() == f"{shown},{count},{count},{count}", root.lengths)
