<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
<context>
    <name>ActionPanel</name>
    <message>
        <source>Send</source>
        <translation>Senden</translation>
    </message>
    <message>
        <source>NO CONTACT: it may still be running</source>
        <translation>KEIN KONTAKT: läuft womöglich weiter</translation>
    </message>
    <message>
        <source>ready</source>
        <translation>bereit</translation>
    </message>
    <message>
        <source>sent, not accepted yet</source>
        <translation>gesendet, noch nicht angenommen</translation>
    </message>
    <message>
        <source>it may still be running</source>
        <translation>läuft womöglich weiter</translation>
    </message>
    <message>
        <source>running</source>
        <translation>läuft</translation>
    </message>
    <message>
        <source>canceling ...</source>
        <translation>bricht ab …</translation>
    </message>
    <message>
        <source>done</source>
        <translation>fertig</translation>
    </message>
    <message>
        <source>CANCELLED</source>
        <translation>ABGEBROCHEN</translation>
    </message>
    <message>
        <source>REFUSED</source>
        <translation>ABGELEHNT</translation>
    </message>
    <message>
        <source>FAILED</source>
        <translation>FEHLGESCHLAGEN</translation>
    </message>
    <message>
        <source>OUTCOME UNKNOWN: it may still be running</source>
        <translation>AUSGANG UNBEKANNT: läuft womöglich weiter</translation>
    </message>
    <message>
        <source>%1: </source>
        <translation>%1: </translation>
    </message>
    <message>
        <source>NOT AVAILABLE: %1</source>
        <translation>NICHT VERFÜGBAR: %1</translation>
    </message>
    <message>
        <source>no server of %1 yet</source>
        <translation>noch kein Server für %1</translation>
    </message>
    <message>
        <source>%1 s</source>
        <translation>%1 s</translation>
    </message>
    <message>
        <source>it could not be shown: %1</source>
        <translation>nicht darstellbar: %1</translation>
    </message>
    <message>
        <source>progressOf failed: %1</source>
        <translation>progressOf ist fehlgeschlagen: %1</translation>
    </message>
    <message>
        <source>its result could not be judged: %1</source>
        <translation>Ergebnis nicht auswertbar: %1</translation>
    </message>
    <message>
        <source>the fields of the goal are not known yet</source>
        <translation>die Felder des Ziels sind noch nicht bekannt</translation>
    </message>
    <message>
        <source>the action was changed before the goal ended</source>
        <translation>die Action wurde gewechselt, bevor das Ziel beendet war</translation>
    </message>
    <message>
        <source>no action is given</source>
        <translation>keine Action angegeben</translation>
    </message>
    <message>
        <source>NOT CANCELLED: %1</source>
        <translation>NICHT ABGEBROCHEN: %1</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>Fortschritt</translation>
    </message>
    <message>
        <source>unknown</source>
        <translation>unbekannt</translation>
    </message>
    <message>
        <source>%1 %</source>
        <translation>%1 %</translation>
    </message>
    <message>
        <source>last feedback %1 s ago</source>
        <translation>letzte Rückmeldung vor %1 s</translation>
    </message>
</context>
<context>
    <name>AlarmList</name>
    <message>
        <source>warning</source>
        <translation>Warnung</translation>
    </message>
    <message>
        <source>error</source>
        <translation>Fehler</translation>
    </message>
    <message>
        <source>silent</source>
        <translation>stumm</translation>
    </message>
    <message>
        <source>Alarms</source>
        <translation>Alarme</translation>
    </message>
    <message>
        <source>none</source>
        <translation>keine</translation>
    </message>
    <message>
        <source>%1 not acknowledged</source>
        <translation>%1 nicht quittiert</translation>
    </message>
    <message>
        <source>%1 active</source>
        <translation>%1 aktiv</translation>
    </message>
    <message>
        <source>nothing is received any more</source>
        <translation>es kommt nichts mehr an</translation>
    </message>
    <message>
        <source>no data yet: %1</source>
        <translation>noch keine Daten: %1</translation>
    </message>
    <message>
        <source>%1 further alarms not shown</source>
        <translation>%1 weitere Alarme nicht gezeigt</translation>
    </message>
    <message>
        <source>no sound: QtWidgets is not installed</source>
        <translation>kein Ton: QtWidgets ist nicht installiert</translation>
    </message>
    <message>
        <source>%1 to %2</source>
        <translation>%1 bis %2</translation>
    </message>
    <message>
        <source>first</source>
        <translation>zuerst</translation>
    </message>
    <message>
        <source>over</source>
        <translation>vorbei</translation>
    </message>
    <message>
        <source>not acknowledged</source>
        <translation>nicht quittiert</translation>
    </message>
    <message>
        <source>Acknowledge all</source>
        <translation>Alle quittieren</translation>
    </message>
    <message>
        <source>Mute</source>
        <translation>Stumm</translation>
    </message>
</context>
<context>
    <name>Attitude</name>
    <message>
        <source>Attitude</source>
        <translation>Lage</translation>
    </message>
    <message>
        <source>pitch %1° roll %2°</source>
        <translation>Nick %1° Roll %2°</translation>
    </message>
    <message>
        <source>nose down %1°</source>
        <translation>Nase %1° tief</translation>
    </message>
    <message>
        <source>nose up %1°</source>
        <translation>Nase %1° hoch</translation>
    </message>
    <message>
        <source>left side down %1°</source>
        <translation>links %1° tief</translation>
    </message>
    <message>
        <source>right side down %1°</source>
        <translation>rechts %1° tief</translation>
    </message>
    <message>
        <source>leans too far</source>
        <translation>neigt sich zu weit</translation>
    </message>
</context>
<context>
    <name>Battery</name>
    <message>
        <source>%1 min</source>
        <translation>%1 min</translation>
    </message>
    <message>
        <source>%1 h %2 min</source>
        <translation>%1 h %2 min</translation>
    </message>
    <message>
        <source>Battery</source>
        <translation>Batterie</translation>
    </message>
    <message>
        <source>%1 V</source>
        <translation>%1 V</translation>
    </message>
    <message>
        <source>charging</source>
        <translation>lädt</translation>
    </message>
    <message>
        <source>? %</source>
        <translation>? %</translation>
    </message>
    <message>
        <source>%1 %</source>
        <translation>%1 %</translation>
    </message>
    <message>
        <source>%1 A</source>
        <translation>%1 A</translation>
    </message>
    <message>
        <source>full in %1</source>
        <translation>voll in %1</translation>
    </message>
    <message>
        <source>%1 left</source>
        <translation>noch %1</translation>
    </message>
</context>
<context>
    <name>CallPanel</name>
    <message>
        <source>%1: %2</source>
        <translation>%1: %2</translation>
    </message>
    <message>
        <source>and %1 more fields</source>
        <translation>und %1 weitere Felder</translation>
    </message>
    <message>
        <source>Call %1</source>
        <translation>%1 aufrufen</translation>
    </message>
    <message>
        <source>Call</source>
        <translation>Aufrufen</translation>
    </message>
    <message>
        <source>service</source>
        <translation>Dienst</translation>
    </message>
    <message>
        <source>Service</source>
        <translation>Dienst</translation>
    </message>
    <message>
        <source>the type of %1 is not known yet</source>
        <translation>der Typ von %1 ist noch nicht bekannt</translation>
    </message>
    <message>
        <source>Enter a service, or set `service`.</source>
        <translation>Dienst eingeben oder `service` setzen.</translation>
    </message>
    <message>
        <source>calling ...</source>
        <translation>Aufruf läuft …</translation>
    </message>
    <message>
        <source>Hold to call</source>
        <translation>Zum Aufrufen halten</translation>
    </message>
</context>
<context>
    <name>CameraGrid</name>
    <message>
        <source>Cameras</source>
        <translation>Kameras</translation>
    </message>
    <message>
        <source>%1 cameras</source>
        <translation>%1 Kameras</translation>
    </message>
    <message>
        <source>NO CAMERA FOUND</source>
        <translation>KEINE KAMERA GEFUNDEN</translation>
    </message>
</context>
<context>
    <name>CameraView</name>
    <message>
        <source>IMAGE FROZEN</source>
        <translation>BILD EINGEFROREN</translation>
    </message>
    <message>
        <source>NO SIGNAL</source>
        <translation>KEIN SIGNAL</translation>
    </message>
    <message>
        <source>IMAGE DELAYED</source>
        <translation>BILD VERZÖGERT</translation>
    </message>
    <message>
        <source>CLOCKS DIFFER</source>
        <translation>UHREN WEICHEN AB</translation>
    </message>
    <message>
        <source>images arrive, but have been equal for %1 s</source>
        <translation>Bilder kommen an, sind aber seit %1 s gleich</translation>
    </message>
    <message>
        <source>by %1 s</source>
        <translation>um %1 s</translation>
    </message>
    <message>
        <source>no camera found</source>
        <translation>keine Kamera gefunden</translation>
    </message>
    <message>
        <source>no image received yet</source>
        <translation>noch kein Bild empfangen</translation>
    </message>
    <message>
        <source>last image %1 s old</source>
        <translation>letztes Bild %1 s alt</translation>
    </message>
    <message>
        <source>saving ...</source>
        <translation>speichert …</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>Kamera</translation>
    </message>
    <message>
        <source>live</source>
        <translation>live</translation>
    </message>
    <message>
        <source>saved %1</source>
        <translation>%1 gespeichert</translation>
    </message>
    <message>
        <source>NOT SAVED: %1</source>
        <translation>NICHT GESPEICHERT: %1</translation>
    </message>
    <message>
        <source>LIVE</source>
        <translation>LIVE</translation>
    </message>
    <message>
        <source>%1 Hz</source>
        <translation>%1 Hz</translation>
    </message>
    <message>
        <source>%1 ms</source>
        <translation>%1 ms</translation>
    </message>
    <message>
        <source>or the clocks of robot and operator differ by that much</source>
        <translation>oder die Uhren von Roboter und Bediener weichen so weit ab</translation>
    </message>
    <message>
        <source>pan and tilt are not sent as %1</source>
        <translation>Schwenken und Neigen werden nicht als %1 gesendet</translation>
    </message>
    <message>
        <source>no camera listens to %1</source>
        <translation>keine Kamera hört auf %1</translation>
    </message>
    <message>
        <source>Save</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>Save the image to a file</source>
        <translation>Bild in eine Datei speichern</translation>
    </message>
    <message>
        <source>Fit</source>
        <translation>Einpassen</translation>
    </message>
    <message>
        <source>Crop</source>
        <translation>Füllen</translation>
    </message>
    <message>
        <source>Stretch</source>
        <translation>Dehnen</translation>
    </message>
    <message>
        <source>How the image fills the view: %1</source>
        <translation>Wie das Bild die Fläche füllt: %1</translation>
    </message>
    <message>
        <source>Turn the image by 90 degrees</source>
        <translation>Bild um 90 Grad drehen</translation>
    </message>
</context>
<context>
    <name>Catalogue</name>
    <message>
        <source>Drive</source>
        <translation>Fahren</translation>
    </message>
    <message>
        <source>See</source>
        <translation>Sehen</translation>
    </message>
    <message>
        <source>Map</source>
        <translation>Karte</translation>
    </message>
    <message>
        <source>Plot</source>
        <translation>Plot</translation>
    </message>
    <message>
        <source>State</source>
        <translation>Zustand</translation>
    </message>
    <message>
        <source>Lists</source>
        <translation>Listen</translation>
    </message>
    <message>
        <source>Call</source>
        <translation>Aufruf</translation>
    </message>
    <message>
        <source>Record</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>Robots</source>
        <translation>Roboter</translation>
    </message>
    <message>
        <source>Own</source>
        <translation>Eigene</translation>
    </message>
    <message>
        <source>Drive keys</source>
        <translation>Fahrtasten</translation>
    </message>
    <message>
        <source>Drive stick</source>
        <translation>Fahrhebel</translation>
    </message>
    <message>
        <source>Emergency stop</source>
        <translation>Not-Halt</translation>
    </message>
    <message>
        <source>Gamepad view</source>
        <translation>Gamepad</translation>
    </message>
    <message>
        <source>Mode switch</source>
        <translation>Modus</translation>
    </message>
    <message>
        <source>Speed</source>
        <translation>Tempo</translation>
    </message>
    <message>
        <source>Who steers</source>
        <translation>Wer steuert</translation>
    </message>
    <message>
        <source>Camera grid</source>
        <translation>Kameras</translation>
    </message>
    <message>
        <source>Camera view</source>
        <translation>Kamera</translation>
    </message>
    <message>
        <source>Attitude</source>
        <translation>Lage</translation>
    </message>
    <message>
        <source>Compass</source>
        <translation>Kompass</translation>
    </message>
    <message>
        <source>Geo map</source>
        <translation>Geokarte</translation>
    </message>
    <message>
        <source>Map view</source>
        <translation>Karte</translation>
    </message>
    <message>
        <source>Scene view</source>
        <translation>3D-Ansicht</translation>
    </message>
    <message>
        <source>Gauge</source>
        <translation>Anzeige</translation>
    </message>
    <message>
        <source>Battery</source>
        <translation>Batterie</translation>
    </message>
    <message>
        <source>Joint view</source>
        <translation>Gelenke</translation>
    </message>
    <message>
        <source>Lamp</source>
        <translation>Lampe</translation>
    </message>
    <message>
        <source>Alarm list</source>
        <translation>Alarme</translation>
    </message>
    <message>
        <source>Diagnostics view</source>
        <translation>Diagnose</translation>
    </message>
    <message>
        <source>Log view</source>
        <translation>Log</translation>
    </message>
    <message>
        <source>Message view</source>
        <translation>Nachricht</translation>
    </message>
    <message>
        <source>Node graph</source>
        <translation>Knotengraph</translation>
    </message>
    <message>
        <source>Tf tree</source>
        <translation>TF-Baum</translation>
    </message>
    <message>
        <source>Topic tree</source>
        <translation>Topics</translation>
    </message>
    <message>
        <source>Action panel</source>
        <translation>Action</translation>
    </message>
    <message>
        <source>Call panel</source>
        <translation>Dienstaufruf</translation>
    </message>
    <message>
        <source>Parameter form</source>
        <translation>Parameter</translation>
    </message>
    <message>
        <source>Publish panel</source>
        <translation>Senden</translation>
    </message>
    <message>
        <source>Service button</source>
        <translation>Dienst-Taste</translation>
    </message>
    <message>
        <source>Recorder</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>Timeline</source>
        <translation>Zeitleiste</translation>
    </message>
    <message>
        <source>Robot switch</source>
        <translation>Roboterwahl</translation>
    </message>
    <message>
        <source>Robot tiles</source>
        <translation>Roboterkacheln</translation>
    </message>
    <message>
        <source>Steers a robot by keys that are held down, wherever the focus in the window is, except in a text field.</source>
        <translation>Steuert einen Roboter mit gehaltenen Tasten, gleich wo der Fokus im Fenster ist, außer in Textfeldern.</translation>
    </message>
    <message>
        <source>A stick to steer a robot with, for mouse, fingers, and the arrow keys.</source>
        <translation>Ein Hebel zum Steuern, für Maus, Finger und Pfeiltasten.</translation>
    </message>
    <message>
        <source>The emergency stop: latched, and it shows what the robot confirms, not what was clicked.</source>
        <translation>Der Not-Halt: rastet ein und zeigt, was der Roboter bestätigt, nicht, was geklickt wurde.</translation>
    </message>
    <message>
        <source>A gamepad&apos;s axes and buttons, live and by name; and a choice where there are several.</source>
        <translation>Achsen und Tasten eines Gamepads, live und mit Namen; bei mehreren mit Auswahl.</translation>
    </message>
    <message>
        <source>The robot&apos;s mode: shows the one that the robot confirms, and requests another; by topics (std_msgs/String or an integer), or of a ROS 2 lifecycle node.</source>
        <translation>Der Modus des Roboters: zeigt den bestätigten und fordert einen anderen an; über Topics (std_msgs/String oder Ganzzahl) oder von einem Lifecycle-Knoten von ROS 2.</translation>
    </message>
    <message>
        <source>How fast the robot drives and turns, from nav_msgs/Odometry or a Twist; and why it does not.</source>
        <translation>Wie schnell der Roboter fährt und dreht, aus nav_msgs/Odometry oder Twist; und warum nicht.</translation>
    </message>
    <message>
        <source>Who else may steer the robot: other publishers of its command topics, nodes of the same name, and the locks of its multiplexer; in words.</source>
        <translation>Wer den Roboter noch steuern kann: andere Publisher der Befehls-Topics, Knoten gleichen Namens und Sperren des Multiplexers; in Worten.</translation>
    </message>
    <message>
        <source>Several cameras side by side; a click or the keyboard makes one of them big.</source>
        <translation>Mehrere Kameras nebeneinander; Klick oder Tastatur vergrößert eine.</translation>
    </message>
    <message>
        <source>A camera&apos;s image.</source>
        <translation>Das Bild einer Kamera.</translation>
    </message>
    <message>
        <source>Artificial horizon: how the robot leans, from sensor_msgs/Imu or nav_msgs/Odometry.</source>
        <translation>Künstlicher Horizont: wie der Roboter sich neigt, aus sensor_msgs/Imu oder nav_msgs/Odometry.</translation>
    </message>
    <message>
        <source>The heading, from sensor_msgs/Imu or nav_msgs/Odometry, and what it is measured from.</source>
        <translation>Der Kurs, aus sensor_msgs/Imu oder nav_msgs/Odometry, und worauf er sich bezieht.</translation>
    </message>
    <message>
        <source>Where a robot with a satellite receiver is, on map tiles from this machine&apos;s disk; nothing is downloaded.</source>
        <translation>Wo ein Roboter mit Satellitenempfänger ist, auf Kartenkacheln dieses Rechners; nichts wird heruntergeladen.</translation>
    </message>
    <message>
        <source>The map with costmaps, the robot, its track, scans, paths and particles; goals, waypoints and the robot&apos;s pose are set by dragging.</source>
        <translation>Die Karte mit Costmaps, Roboter, Spur, Scans, Pfaden und Partikeln; Ziele, Wegpunkte und die Pose werden durch Ziehen gesetzt.</translation>
    </message>
    <message>
        <source>The robot in 3D: displays as in RViz.</source>
        <translation>Der Roboter in 3D: Displays wie in RViz.</translation>
    </message>
    <message>
        <source>A number of any topic on a dial or a bar, with thresholds.</source>
        <translation>Eine Zahl eines beliebigen Topics als Zeiger oder Balken, mit Schwellen.</translation>
    </message>
    <message>
        <source>Numbers of any topics over time, or one against another, with every sample kept.</source>
        <translation>Zahlen beliebiger Topics über der Zeit oder gegeneinander, ohne Verlust von Werten.</translation>
    </message>
    <message>
        <source>How much is left in a battery, and for how long, of sensor_msgs/BatteryState.</source>
        <translation>Wie voll eine Batterie ist und wie lange sie reicht, aus sensor_msgs/BatteryState.</translation>
    </message>
    <message>
        <source>The joints of a robot and how near they are to their limits, of sensor_msgs/JointState and URDF.</source>
        <translation>Die Gelenke und wie nah sie am Anschlag sind, aus sensor_msgs/JointState und URDF.</translation>
    </message>
    <message>
        <source>A lamp for a boolean of any topic, or for a number beyond a threshold; lit, dark or unknown, in words as well.</source>
        <translation>Eine Lampe für einen Wahrheitswert oder eine Zahl über einer Schwelle; ein, aus oder unbekannt, auch in Worten.</translation>
    </message>
    <message>
        <source>Alarms of diagnostic_msgs/DiagnosticArray and std_msgs/Bool, which stay until they are acknowledged.</source>
        <translation>Alarme aus diagnostic_msgs/DiagnosticArray und std_msgs/Bool, die bis zum Quittieren bleiben.</translation>
    </message>
    <message>
        <source>What the parts of a robot report about themselves, of diagnostic_msgs/DiagnosticArray.</source>
        <translation>Was die Teile eines Roboters über sich melden, aus diagnostic_msgs/DiagnosticArray.</translation>
    </message>
    <message>
        <source>The log messages of all nodes, of rcl_interfaces/Log or rosgraph_msgs/Log.</source>
        <translation>Die Log-Meldungen aller Knoten, aus rcl_interfaces/Log oder rosgraph_msgs/Log.</translation>
    </message>
    <message>
        <source>The message of any topic as a tree of fields with their units; edited, it can be published.</source>
        <translation>Die Nachricht eines Topics als Baum der Felder mit Einheiten; bearbeitet lässt sie sich senden.</translation>
    </message>
    <message>
        <source>Nodes and topics of the robot as a graph: drag to move it, turn the wheel or pinch to zoom.</source>
        <translation>Knoten und Topics als Graph: ziehen verschiebt, Rad oder zwei Finger zoomen.</translation>
    </message>
    <message>
        <source>The frames of the robot as a tree, with the age and rate of each transform, and what is wrong with it.</source>
        <translation>Die Frames als Baum, mit Alter und Rate jeder Transformation und ihren Fehlern.</translation>
    </message>
    <message>
        <source>All topics of the robot as a tree, with types, publishers, subscribers, rates, and what does not match.</source>
        <translation>Alle Topics als Baum, mit Typen, Publishern, Subscribern, Raten und Unstimmigkeiten.</translation>
    </message>
    <message>
        <source>Sends goals to an action of any type: shows progress, result and why a goal was refused or lost, and cancels it.</source>
        <translation>Sendet Ziele an eine Action beliebigen Typs: zeigt Fortschritt, Ergebnis und Gründe für Ablehnung oder Verlust, und bricht ab.</translation>
    </message>
    <message>
        <source>Calls a service of any type, with a request that is filled in by hand, and shows the whole response.</source>
        <translation>Ruft einen Dienst beliebigen Typs mit von Hand ausgefüllter Anfrage auf und zeigt die ganze Antwort.</translation>
    </message>
    <message>
        <source>All parameters of a node, to show and to change: with ranges, choices, refused values and undo.</source>
        <translation>Alle Parameter eines Knotens, zum Zeigen und Ändern: mit Bereichen, Auswahl, abgelehnten Werten und Rückgängig.</translation>
    </message>
    <message>
        <source>Publishes messages of any type on a topic, filled in by hand: once, or again and again at a rate.</source>
        <translation>Sendet von Hand ausgefüllte Nachrichten beliebigen Typs auf einem Topic: einmal oder mit einer Rate.</translation>
    </message>
    <message>
        <source>A button that calls a service of any type, and shows how the call ended.</source>
        <translation>Eine Taste, die einen Dienst beliebigen Typs aufruft und zeigt, wie es ausging.</translation>
    </message>
    <message>
        <source>Records topics to an MCAP file or a ROS 1 bag, with limits and event marks.</source>
        <translation>Nimmt Topics in eine MCAP-Datei oder ein ROS-1-Bag auf, mit Grenzen und Marken.</translation>
    </message>
    <message>
        <source>The time of a recording that an interface shows: play, pause, drag, speed, loop, and its event marks.</source>
        <translation>Die Zeit einer Aufnahme: abspielen, Pause, ziehen, Tempo, Schleife und Marken.</translation>
    </message>
    <message>
        <source>The robots of a graph, one of which is shown and steered: its namespace is `current`.</source>
        <translation>Die Roboter eines Graphen, von denen einer gezeigt und gesteuert wird: sein Namespace ist `current`.</translation>
    </message>
    <message>
        <source>All robots at a glance: a tile for each, with camera, battery, mode, alarms and age.</source>
        <translation>Alle Roboter auf einen Blick: je eine Kachel mit Kamera, Batterie, Modus, Alarmen und Alter.</translation>
    </message>
</context>
<context>
    <name>CatalogueBox</name>
    <message>
        <source>Panels to add</source>
        <translation>Panels zum Hinzufügen</translation>
    </message>
    <message>
        <source>Search panels</source>
        <translation>Panels suchen</translation>
    </message>
    <message>
        <source>Panels</source>
        <translation>Panels</translation>
    </message>
    <message>
        <source>No panel has this name.</source>
        <translation>Kein Panel heißt so.</translation>
    </message>
</context>
<context>
    <name>Cockpit</name>
    <message>
        <source>Ctrl+1 … Ctrl+9</source>
        <translation>Strg+1 … Strg+9</translation>
    </message>
    <message>
        <source>page</source>
        <translation>Seite</translation>
    </message>
    <message>
        <source>Ctrl+Page Up, Ctrl+Page Down</source>
        <translation>Strg+Bild auf, Strg+Bild ab</translation>
    </message>
    <message>
        <source>page before, page after</source>
        <translation>vorige, nächste Seite</translation>
    </message>
    <message>
        <source>Ctrl+Tab, Ctrl+Shift+Tab</source>
        <translation>Strg+Tab, Strg+Umschalt+Tab</translation>
    </message>
    <message>
        <source>next tab, last tab</source>
        <translation>nächster, voriger Reiter</translation>
    </message>
    <message>
        <source>F6, Shift+F6</source>
        <translation>F6, Umschalt+F6</translation>
    </message>
    <message>
        <source>next panel, last panel</source>
        <translation>nächstes, voriges Panel</translation>
    </message>
    <message>
        <source>F11</source>
        <translation>F11</translation>
    </message>
    <message>
        <source>maximise the panel, restore it</source>
        <translation>Panel maximieren, wiederherstellen</translation>
    </message>
    <message>
        <source>Shift+F10</source>
        <translation>Umschalt+F10</translation>
    </message>
    <message>
        <source>menu of the panel</source>
        <translation>Menü des Panels</translation>
    </message>
    <message>
        <source>F1</source>
        <translation>F1</translation>
    </message>
    <message>
        <source>help on the panel</source>
        <translation>Hilfe zum Panel</translation>
    </message>
    <message>
        <source>Ctrl+Shift+arrow keys</source>
        <translation>Strg+Umschalt+Pfeiltasten</translation>
    </message>
    <message>
        <source>move the panel past its neighbour, or to the edge of the page; move the page</source>
        <translation>Panel am Nachbarn vorbei oder an den Seitenrand verschieben; Seite verschieben</translation>
    </message>
    <message>
        <source>F8, arrow keys, Enter</source>
        <translation>F8, Pfeiltasten, Enter</translation>
    </message>
    <message>
        <source>change the size of the panel; with Shift, finely</source>
        <translation>Größe des Panels ändern; mit Umschalt fein</translation>
    </message>
    <message>
        <source>F2</source>
        <translation>F2</translation>
    </message>
    <message>
        <source>rename the panel or page</source>
        <translation>Panel oder Seite umbenennen</translation>
    </message>
    <message>
        <source>Del</source>
        <translation>Entf</translation>
    </message>
    <message>
        <source>remove the panel or page</source>
        <translation>Panel oder Seite entfernen</translation>
    </message>
    <message>
        <source>Esc</source>
        <translation>Esc</translation>
    </message>
    <message>
        <source>cancel dragging</source>
        <translation>Ziehen abbrechen</translation>
    </message>
    <message>
        <source>This page is empty: choose a panel from the list, or drag one here.</source>
        <translation>Diese Seite ist leer: ein Panel aus der Liste wählen oder hierher ziehen.</translation>
    </message>
    <message>
        <source>This page is empty. Edit the layout to add panels.</source>
        <translation>Diese Seite ist leer. Beim Bearbeiten des Layouts Panels hinzufügen.</translation>
    </message>
</context>
<context>
    <name>CockpitProgram</name>
    <message>
        <source>looking …</source>
        <translation>sucht …</translation>
    </message>
    <message>
        <source>{} nodes, {} topics</source>
        <translation>{} Knoten, {} Topics</translation>
    </message>
    <message>
        <source>reading {} …</source>
        <translation>liest {} …</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
    <message>
        <source>{} is open</source>
        <translation>{} ist offen</translation>
    </message>
    <message>
        <source>Recording</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>no recording is open</source>
        <translation>keine Aufnahme offen</translation>
    </message>
    <message>
        <source>this is a recording; connect to a robot to record it</source>
        <translation>dies ist eine Aufnahme; zum Aufnehmen mit einem Roboter verbinden</translation>
    </message>
    <message>
        <source>connect to a robot first</source>
        <translation>zuerst mit einem Roboter verbinden</translation>
    </message>
    <message>
        <source>a simulated robot is being started</source>
        <translation>ein simulierter Roboter wird gestartet</translation>
    </message>
    <message>
        <source>the simulated robot could not be started: try `rosglass demo`</source>
        <translation>der simulierte Roboter startet nicht: `rosglass demo` versuchen</translation>
    </message>
    <message>
        <source>Robot</source>
        <translation>Roboter</translation>
    </message>
    <message>
        <source>needs OpenGL: start with --renderer opengl</source>
        <translation>braucht OpenGL: mit --renderer opengl starten</translation>
    </message>
    <message>
        <source> and {} more</source>
        <translation> und {} weitere</translation>
    </message>
    <message>
        <source>{} was not opened here before. It can send to the robot: {}. Open it only if you know where it comes from.</source>
        <translation>{} wurde hier noch nie geöffnet. Es kann an den Roboter senden: {}. Nur öffnen, wenn die Herkunft bekannt ist.</translation>
    </message>
    <message>
        <source>Open, and trust this folder</source>
        <translation>Öffnen und dem Ordner vertrauen</translation>
    </message>
    <message>
        <source>Open once</source>
        <translation>Einmal öffnen</translation>
    </message>
    <message>
        <source>Do not open</source>
        <translation>Nicht öffnen</translation>
    </message>
    <message>
        <source>The cockpit ended before changes of {} were saved.</source>
        <translation>Das Cockpit endete, bevor Änderungen an {} gespeichert waren.</translation>
    </message>
    <message>
        <source>Restore them</source>
        <translation>Wiederherstellen</translation>
    </message>
    <message>
        <source>Discard them</source>
        <translation>Verwerfen</translation>
    </message>
    <message>
        <source>Restore</source>
        <translation>Wiederherstellen</translation>
    </message>
    <message>
        <source>Cockpit</source>
        <translation>Cockpit</translation>
    </message>
    <message>
        <source>The cockpit ended before a new layout was saved.</source>
        <translation>Das Cockpit endete, bevor ein neues Layout gespeichert war.</translation>
    </message>
    <message>
        <source>Restore it</source>
        <translation>Wiederherstellen</translation>
    </message>
    <message>
        <source>Discard it</source>
        <translation>Verwerfen</translation>
    </message>
    <message>
        <source>and {} more, which are logged</source>
        <translation>und {} weitere, die im Log stehen</translation>
    </message>
    <message>
        <source>This layout of {} was read, except for:</source>
        <translation>Dieses Layout von {} wurde gelesen, bis auf:</translation>
    </message>
    <message>
        <source>this layout of {} was read</source>
        <translation>dieses Layout von {} wurde gelesen</translation>
    </message>
    <message>
        <source>A plugin asks for {}: a kiosk&apos;s layout stays</source>
        <translation>Ein Plugin verlangt {}: das Layout eines Kiosks bleibt</translation>
    </message>
    <message>
        <source>Add {}</source>
        <translation>{} hinzufügen</translation>
    </message>
    <message>
        <source>Change {}</source>
        <translation>{} ändern</translation>
    </message>
    <message>
        <source>Rename</source>
        <translation>Umbenennen</translation>
    </message>
    <message>
        <source>Commands</source>
        <translation>Befehle</translation>
    </message>
    <message>
        <source>Start page: robots and layouts</source>
        <translation>Startseite: Roboter und Layouts</translation>
    </message>
    <message>
        <source>New layout</source>
        <translation>Neues Layout</translation>
    </message>
    <message>
        <source>Open a layout</source>
        <translation>Layout öffnen</translation>
    </message>
    <message>
        <source>Save the layout</source>
        <translation>Layout speichern</translation>
    </message>
    <message>
        <source>Save the layout as …</source>
        <translation>Layout speichern unter …</translation>
    </message>
    <message>
        <source>Edit the layout, or use it</source>
        <translation>Layout bearbeiten oder benutzen</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Redo</source>
        <translation>Wiederholen</translation>
    </message>
    <message>
        <source>Remove the selected panel</source>
        <translation>Gewähltes Panel entfernen</translation>
    </message>
    <message>
        <source>Add a page</source>
        <translation>Seite hinzufügen</translation>
    </message>
    <message>
        <source>Pages for all robots</source>
        <translation>Seiten für alle Roboter</translation>
    </message>
    <message>
        <source>New layout of what the robot offers</source>
        <translation>Neues Layout aus dem, was der Roboter bietet</translation>
    </message>
    <message>
        <source>Search robots</source>
        <translation>Roboter suchen</translation>
    </message>
    <message>
        <source>Try it on a simulated robot</source>
        <translation>An simuliertem Roboter testen</translation>
    </message>
    <message>
        <source>Open a recording</source>
        <translation>Aufnahme öffnen</translation>
    </message>
    <message>
        <source>Close the recording</source>
        <translation>Aufnahme schließen</translation>
    </message>
    <message>
        <source>Record, or stop recording</source>
        <translation>Aufnehmen oder beenden</translation>
    </message>
    <message>
        <source>Mark this moment in the recording</source>
        <translation>Diesen Moment in der Aufnahme markieren</translation>
    </message>
    <message>
        <source>Find a panel to add</source>
        <translation>Panel zum Hinzufügen suchen</translation>
    </message>
    <message>
        <source>Properties of the selected panel</source>
        <translation>Eigenschaften des gewählten Panels</translation>
    </message>
    <message>
        <source>Keys</source>
        <translation>Tasten</translation>
    </message>
    <message>
        <source>Tour of the cockpit</source>
        <translation>Rundgang durchs Cockpit</translation>
    </message>
    <message>
        <source>Help</source>
        <translation>Hilfe</translation>
    </message>
    <message>
        <source>Add panel: {}</source>
        <translation>Panel hinzufügen: {}</translation>
    </message>
    <message>
        <source>there is no command {}</source>
        <translation>es gibt keinen Befehl {}</translation>
    </message>
    <message>
        <source>open or make a layout first</source>
        <translation>zuerst ein Layout öffnen oder anlegen</translation>
    </message>
    <message>
        <source>the layout is changed in edit mode only: F4</source>
        <translation>Das Layout wird nur beim Bearbeiten geändert: F4</translation>
    </message>
    <message>
        <source>select a panel first</source>
        <translation>zuerst ein Panel wählen</translation>
    </message>
    <message>
        <source>Remove {}</source>
        <translation>{} entfernen</translation>
    </message>
    <message>
        <source>panel</source>
        <translation>Panel</translation>
    </message>
    <message>
        <source>Add page</source>
        <translation>Seite hinzufügen</translation>
    </message>
    <message>
        <source>Page</source>
        <translation>Seite</translation>
    </message>
    <message>
        <source>each of the {} robots has its page</source>
        <translation>jeder der {} Roboter hat seine Seite</translation>
    </message>
    <message>
        <source>{} pages; the same on all: {}</source>
        <translation>{} Seiten; auf allen gleich: {}</translation>
    </message>
    <message>
        <source>{} pages</source>
        <translation>{} Seiten</translation>
    </message>
    <message>
        <source>{} exists already.</source>
        <translation>{} gibt es schon.</translation>
    </message>
    <message>
        <source>Replace it</source>
        <translation>Ersetzen</translation>
    </message>
    <message>
        <source>choose a file first: Ctrl+Shift+S</source>
        <translation>zuerst eine Datei wählen: Strg+Umschalt+S</translation>
    </message>
    <message>
        <source>saved to {}</source>
        <translation>gespeichert in {}</translation>
    </message>
    <message>
        <source>{} has changes that are not saved.</source>
        <translation>{} hat ungespeicherte Änderungen.</translation>
    </message>
    <message>
        <source>Save</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>Verwerfen</translation>
    </message>
    <message>
        <source>Go on</source>
        <translation>Zurück</translation>
    </message>
    <message>
        <source>this is not among the pages that come with the cockpit: {}</source>
        <translation>diese Seite gehört nicht zur Hilfe des Cockpits: {}</translation>
    </message>
    <message>
        <source>In a layout</source>
        <translation>Im Layout</translation>
    </message>
    <message>
        <source>In edit mode</source>
        <translation>Beim Bearbeiten</translation>
    </message>
    <message>
        <source>connected</source>
        <translation>verbunden</translation>
    </message>
    <message>
        <source>connecting</source>
        <translation>verbindet</translation>
    </message>
    <message>
        <source>connection lost</source>
        <translation>Verbindung verloren</translation>
    </message>
    <message>
        <source>closed</source>
        <translation>geschlossen</translation>
    </message>
    <message>
        <source>failed</source>
        <translation>fehlgeschlagen</translation>
    </message>
    <message>
        <source>Changes from outside</source>
        <translation>Änderungen von außen</translation>
    </message>
    <message>
        <source>{} was changed by another program; merged</source>
        <translation>{} wurde von einem anderen Programm geändert; zusammengeführt</translation>
    </message>
    <message>
        <source>{} was changed by another program, in the same lines as here.</source>
        <translation>{} wurde von einem anderen Programm in denselben Zeilen geändert wie hier.</translation>
    </message>
    <message>
        <source>Take theirs</source>
        <translation>Fremde übernehmen</translation>
    </message>
    <message>
        <source>Keep mine</source>
        <translation>Eigene behalten</translation>
    </message>
</context>
<context>
    <name>CommandPalette</name>
    <message>
        <source>Type a command</source>
        <translation>Befehl eingeben</translation>
    </message>
    <message>
        <source>Commands</source>
        <translation>Befehle</translation>
    </message>
    <message>
        <source>No command has this name.</source>
        <translation>Kein Befehl heißt so.</translation>
    </message>
</context>
<context>
    <name>Compass</name>
    <message>
        <source>from x of %1</source>
        <translation>von x von %1</translation>
    </message>
    <message>
        <source>magnetic north</source>
        <translation>magnetisch Nord</translation>
    </message>
    <message>
        <source>true north</source>
        <translation>geografisch Nord</translation>
    </message>
    <message>
        <source>reference is &quot;magnetic&quot;, &quot;true&quot; or &quot;frame&quot;, not &quot;%1&quot;</source>
        <translation>reference ist &quot;magnetic&quot;, &quot;true&quot; oder &quot;frame&quot;, nicht &quot;%1&quot;</translation>
    </message>
    <message>
        <source>a frame without a name</source>
        <translation>ein Frame ohne Namen</translation>
    </message>
    <message>
        <source>N</source>
        <translation>N</translation>
    </message>
    <message>
        <source>E</source>
        <translation>O</translation>
    </message>
    <message>
        <source>S</source>
        <translation>S</translation>
    </message>
    <message>
        <source>W</source>
        <translation>W</translation>
    </message>
    <message>
        <source>NE</source>
        <translation>NO</translation>
    </message>
    <message>
        <source>SE</source>
        <translation>SO</translation>
    </message>
    <message>
        <source>SW</source>
        <translation>SW</translation>
    </message>
    <message>
        <source>NW</source>
        <translation>NW</translation>
    </message>
    <message>
        <source>Compass</source>
        <translation>Kompass</translation>
    </message>
    <message>
        <source>?</source>
        <translation>?</translation>
    </message>
    <message>
        <source>%1°</source>
        <translation>%1°</translation>
    </message>
</context>
<context>
    <name>DiagnosticsView</name>
    <message>
        <source>ok</source>
        <translation>ok</translation>
    </message>
    <message>
        <source>warning</source>
        <translation>Warnung</translation>
    </message>
    <message>
        <source>error</source>
        <translation>Fehler</translation>
    </message>
    <message>
        <source>stale</source>
        <translation>veraltet</translation>
    </message>
    <message>
        <source>Diagnostics</source>
        <translation>Diagnose</translation>
    </message>
    <message>
        <source>1 error</source>
        <translation>1 Fehler</translation>
    </message>
    <message>
        <source>%1 errors</source>
        <translation>%1 Fehler</translation>
    </message>
    <message>
        <source>%1 stale</source>
        <translation>%1 veraltet</translation>
    </message>
    <message>
        <source>1 warning</source>
        <translation>1 Warnung</translation>
    </message>
    <message>
        <source>%1 warnings</source>
        <translation>%1 Warnungen</translation>
    </message>
    <message>
        <source>all good</source>
        <translation>alles gut</translation>
    </message>
    <message>
        <source>%1 filtered out</source>
        <translation>%1 ausgefiltert</translation>
    </message>
    <message>
        <source>%1 reports of further parts not shown</source>
        <translation>%1 Meldungen weiterer Teile nicht gezeigt</translation>
    </message>
    <message>
        <source>%1 messages lost</source>
        <translation>%1 Nachrichten verloren</translation>
    </message>
    <message>
        <source>silent for %1 s, said: %2</source>
        <translation>seit %1 s stumm, zuletzt: %2</translation>
    </message>
    <message>
        <source>hardware: %1</source>
        <translation>Hardware: %1</translation>
    </message>
    <message>
        <source>%1 more values</source>
        <translation>%1 weitere Werte</translation>
    </message>
</context>
<context>
    <name>DragLayer</name>
    <message>
        <source>%1: own window</source>
        <translation>%1: eigenes Fenster</translation>
    </message>
    <message>
        <source>%1: to %2</source>
        <translation>%1: nach %2</translation>
    </message>
    <message>
        <source>Size of %1: arrow keys; Enter when done</source>
        <translation>Größe von %1: Pfeiltasten; fertig mit Enter</translation>
    </message>
</context>
<context>
    <name>DriveKeys</name>
    <message>
        <source>Keys that drive the robot</source>
        <translation>Tasten zum Fahren</translation>
    </message>
</context>
<context>
    <name>DriveStick</name>
    <message>
        <source>Drive stick</source>
        <translation>Fahrhebel</translation>
    </message>
    <message>
        <source>Drag it, or hold the arrow keys</source>
        <translation>Ziehen oder Pfeiltasten halten</translation>
    </message>
</context>
<context>
    <name>EditMessageDialog</name>
    <message>
        <source>This is not JSON: %1</source>
        <translation>Das ist kein JSON: %1</translation>
    </message>
    <message>
        <source>Message</source>
        <translation>Nachricht</translation>
    </message>
    <message>
        <source>Edit Message Content</source>
        <translation>Nachricht bearbeiten</translation>
    </message>
    <message>
        <source>Visual</source>
        <translation>Formular</translation>
    </message>
    <message>
        <source>JSON</source>
        <translation>JSON</translation>
    </message>
    <message>
        <source>Copy JSON</source>
        <translation>JSON kopieren</translation>
    </message>
</context>
<context>
    <name>Editor</name>
    <message>
        <source>Cockpit</source>
        <translation>Cockpit</translation>
    </message>
    <message>
        <source>Choose the robot here. Without one, try everything on a simulated robot.</source>
        <translation>Hier den Roboter wählen. Ohne Roboter lässt sich alles an einem simulierten testen.</translation>
    </message>
    <message>
        <source>Add panels: show all that suits the robot, or start with an empty layout and choose from the list on the left.</source>
        <translation>Panels hinzufügen: alle zeigen, die zum Roboter passen, oder leer beginnen und aus der Liste links wählen.</translation>
    </message>
    <message>
        <source>F4 changes between editing and using a layout. While it is used, nothing moves under your hand.</source>
        <translation>F4 wechselt zwischen Bearbeiten und Benutzen. Beim Benutzen verrutscht nichts unter der Hand.</translation>
    </message>
    <message>
        <source>%1 finds every command by a part of its name, the list of keys and this tour included. F1 explains the current panel.</source>
        <translation>%1 findet jeden Befehl nach einem Teil seines Namens, auch die Tastenliste und diesen Rundgang. F1 erklärt das aktuelle Panel.</translation>
    </message>
    <message>
        <source>%1 has changes that are not saved.</source>
        <translation>%1 hat ungespeicherte Änderungen.</translation>
    </message>
    <message>
        <source>Save</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>Verwerfen</translation>
    </message>
    <message>
        <source>Go on</source>
        <translation>Zurück</translation>
    </message>
</context>
<context>
    <name>EditorBar</name>
    <message>
        <source>Tools</source>
        <translation>Werkzeuge</translation>
    </message>
    <message>
        <source>Home</source>
        <translation>Start</translation>
    </message>
    <message>
        <source>Open</source>
        <translation>Öffnen</translation>
    </message>
    <message>
        <source>Save •</source>
        <translation>Speichern •</translation>
    </message>
    <message>
        <source>Save</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>Done</source>
        <translation>Fertig</translation>
    </message>
    <message>
        <source>Edit</source>
        <translation>Bearbeiten</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Redo</source>
        <translation>Wiederholen</translation>
    </message>
    <message>
        <source>Record</source>
        <translation>Aufnehmen</translation>
    </message>
    <message>
        <source>● Stop recording, %1 s</source>
        <translation>● Aufnahme beenden, %1 s</translation>
    </message>
    <message>
        <source>Commands …</source>
        <translation>Befehle …</translation>
    </message>
    <message>
        <source>Robot</source>
        <translation>Roboter</translation>
    </message>
    <message>
        <source>Find robot</source>
        <translation>Roboter suchen</translation>
    </message>
    <message>
        <source>Close recording</source>
        <translation>Aufnahme schließen</translation>
    </message>
</context>
<context>
    <name>EmergencyStop</name>
    <message>
        <source>Emergency stop</source>
        <translation>Not-Halt</translation>
    </message>
    <message>
        <source>the robot&apos;s counter was unknown</source>
        <translation>der Zähler des Roboters war unbekannt</translation>
    </message>
    <message>
        <source>no connection</source>
        <translation>keine Verbindung</translation>
    </message>
    <message>
        <source>%1 has the type %2, which is not Trigger or SetBool</source>
        <translation>%1 hat den Typ %2, nicht Trigger oder SetBool</translation>
    </message>
    <message>
        <source>no service releases</source>
        <translation>kein Dienst gibt frei</translation>
    </message>
    <message>
        <source>refused: %1</source>
        <translation>abgelehnt: %1</translation>
    </message>
    <message>
        <source>refused</source>
        <translation>abgelehnt</translation>
    </message>
    <message>
        <source>the stop of the last robot was not confirmed</source>
        <translation>der Halt des letzten Roboters wurde nicht bestätigt</translation>
    </message>
    <message>
        <source>STOPPED</source>
        <translation>GESTOPPT</translation>
    </message>
    <message>
        <source>STOP</source>
        <translation>STOPP</translation>
    </message>
    <message>
        <source>NOT CONFIRMED</source>
        <translation>NICHT BESTÄTIGT</translation>
    </message>
    <message>
        <source>sending…</source>
        <translation>sendet …</translation>
    </message>
    <message>
        <source>not connected</source>
        <translation>nicht verbunden</translation>
    </message>
    <message>
        <source>confirmed</source>
        <translation>bestätigt</translation>
    </message>
    <message>
        <source>held by someone else</source>
        <translation>von anderen gehalten</translation>
    </message>
    <message>
        <source>by someone else</source>
        <translation>von anderen</translation>
    </message>
    <message>
        <source>press</source>
        <translation>drücken</translation>
    </message>
    <message>
        <source>state unknown</source>
        <translation>Zustand unbekannt</translation>
    </message>
    <message>
        <source>space bar</source>
        <translation>Leertaste</translation>
    </message>
    <message>
        <source>Release the emergency stop</source>
        <translation>Not-Halt freigeben</translation>
    </message>
    <message>
        <source>hold, or Enter, to release</source>
        <translation>halten oder Enter: freigeben</translation>
    </message>
    <message>
        <source>hold to release</source>
        <translation>zum Freigeben halten</translation>
    </message>
</context>
<context>
    <name>FilePicker</name>
    <message>
        <source>Save the layout</source>
        <translation>Layout speichern</translation>
    </message>
    <message>
        <source>Open a recording</source>
        <translation>Aufnahme öffnen</translation>
    </message>
    <message>
        <source>Open a layout</source>
        <translation>Layout öffnen</translation>
    </message>
    <message>
        <source>Recordings (*.mcap *.bag *.db3 *.yaml)</source>
        <translation>Aufnahmen (*.mcap *.bag *.db3 *.yaml)</translation>
    </message>
    <message>
        <source>All files (*)</source>
        <translation>Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Layouts (*.qml)</source>
        <translation>Layouts (*.qml)</translation>
    </message>
    <message>
        <source>Layouts (*.qml *.json *.rqml)</source>
        <translation>Layouts (*.qml *.json *.rqml)</translation>
    </message>
</context>
<context>
    <name>GamepadView</name>
    <message>
        <source>Gamepad</source>
        <translation>Gamepad</translation>
    </message>
    <message>
        <source>no Gamepad is set</source>
        <translation>kein Gamepad gesetzt</translation>
    </message>
    <message>
        <source>%1 is not connected</source>
        <translation>%1 ist nicht verbunden</translation>
    </message>
    <message>
        <source>no gamepad is connected</source>
        <translation>kein Gamepad verbunden</translation>
    </message>
    <message>
        <source>does not count: %1</source>
        <translation>zählt nicht: %1</translation>
    </message>
    <message>
        <source>does not steer: %1</source>
        <translation>steuert nicht: %1</translation>
    </message>
    <message>
        <source>steers</source>
        <translation>steuert</translation>
    </message>
    <message>
        <source>hold %1 to steer</source>
        <translation>zum Steuern %1 halten</translation>
    </message>
    <message>
        <source>let go</source>
        <translation>losgelassen</translation>
    </message>
</context>
<context>
    <name>Gauge</name>
    <message>
        <source>?</source>
        <translation>?</translation>
    </message>
    <message>
        <source>set path: &quot;topic:field&quot;, or drop a field here</source>
        <translation>path setzen: &quot;topic:feld&quot;, oder ein Feld hier ablegen</translation>
    </message>
    <message>
        <source>from %1 is not less than to %2</source>
        <translation>from %1 ist nicht kleiner als to %2</translation>
    </message>
    <message>
        <source>style is &quot;dial&quot; or &quot;bar&quot;, not &quot;%1&quot;</source>
        <translation>style ist &quot;dial&quot; oder &quot;bar&quot;, nicht &quot;%1&quot;</translation>
    </message>
    <message>
        <source>not a number</source>
        <translation>keine Zahl</translation>
    </message>
    <message>
        <source>above %1</source>
        <translation>über %1</translation>
    </message>
    <message>
        <source>below %1</source>
        <translation>unter %1</translation>
    </message>
    <message>
        <source>bad</source>
        <translation>schlecht</translation>
    </message>
    <message>
        <source>warning</source>
        <translation>Warnung</translation>
    </message>
</context>
<context>
    <name>GeoMap</name>
    <message>
        <source>no data</source>
        <translation>keine Daten</translation>
    </message>
    <message>
        <source>fix unknown</source>
        <translation>Fix unbekannt</translation>
    </message>
    <message>
        <source>NO FIX</source>
        <translation>KEIN FIX</translation>
    </message>
    <message>
        <source>no valid position</source>
        <translation>keine gültige Position</translation>
    </message>
    <message>
        <source>fix, ground-based augmentation</source>
        <translation>Fix mit Bodenkorrektur (GBAS)</translation>
    </message>
    <message>
        <source>fix, satellite-based augmentation</source>
        <translation>Fix mit Satellitenkorrektur (SBAS)</translation>
    </message>
    <message>
        <source>fix</source>
        <translation>Fix</translation>
    </message>
    <message>
        <source>Position</source>
        <translation>Position</translation>
    </message>
    <message>
        <source>%1: the last position is shown</source>
        <translation>%1: letzte Position gezeigt</translation>
    </message>
    <message>
        <source>%1 is not read: tiles come from a folder or an MBTiles file</source>
        <translation>%1 wird nicht gelesen: Kacheln kommen aus einem Ordner oder einer MBTiles-Datei</translation>
    </message>
    <message>
        <source>± %1 m</source>
        <translation>± %1 m</translation>
    </message>
    <message>
        <source>Follow</source>
        <translation>Folgen</translation>
    </message>
    <message>
        <source>Zoom in</source>
        <translation>Vergrößern</translation>
    </message>
    <message>
        <source>Zoom out</source>
        <translation>Verkleinern</translation>
    </message>
    <message>
        <source>Clear track</source>
        <translation>Spur löschen</translation>
    </message>
</context>
<context>
    <name>HelpBox</name>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
</context>
<context>
    <name>JointView</name>
    <message>
        <source>unit is &quot;deg&quot; or &quot;rad&quot;, not &quot;%1&quot;</source>
        <translation>unit ist &quot;deg&quot; oder &quot;rad&quot;, nicht &quot;%1&quot;</translation>
    </message>
    <message>
        <source>?</source>
        <translation>?</translation>
    </message>
    <message>
        <source>Joints</source>
        <translation>Gelenke</translation>
    </message>
    <message>
        <source>%1 at the limit</source>
        <translation>%1 am Anschlag</translation>
    </message>
    <message>
        <source>%1 silent</source>
        <translation>%1 stumm</translation>
    </message>
    <message>
        <source>%1 joints</source>
        <translation>%1 Gelenke</translation>
    </message>
    <message>
        <source>limits: %1</source>
        <translation>Grenzen: %1</translation>
    </message>
    <message>
        <source>%1 without limits</source>
        <translation>%1 ohne Grenzen</translation>
    </message>
    <message>
        <source>%1 further joints not shown</source>
        <translation>%1 weitere Gelenke nicht gezeigt</translation>
    </message>
    <message>
        <source>silent for %1 s</source>
        <translation>seit %1 s stumm</translation>
    </message>
    <message>
        <source>no position</source>
        <translation>keine Position</translation>
    </message>
    <message>
        <source>at the limit</source>
        <translation>am Anschlag</translation>
    </message>
    <message>
        <source>near the limit</source>
        <translation>nahe am Anschlag</translation>
    </message>
    <message>
        <source>%1 N</source>
        <translation>%1 N</translation>
    </message>
    <message>
        <source>%1 Nm</source>
        <translation>%1 Nm</translation>
    </message>
    <message>
        <source>effort %1</source>
        <translation>Kraft %1</translation>
    </message>
</context>
<context>
    <name>Lamp</name>
    <message>
        <source>ON</source>
        <translation>EIN</translation>
    </message>
    <message>
        <source>OFF</source>
        <translation>AUS</translation>
    </message>
    <message>
        <source>?</source>
        <translation>?</translation>
    </message>
    <message>
        <source>set path: &quot;topic:field&quot;, or drop a field here</source>
        <translation>path setzen: &quot;topic:feld&quot;, oder ein Feld hier ablegen</translation>
    </message>
    <message>
        <source>not a number</source>
        <translation>keine Zahl</translation>
    </message>
</context>
<context>
    <name>LiveFrame</name>
    <message>
        <source>NO DATA YET</source>
        <translation>NOCH KEINE DATEN</translation>
    </message>
    <message>
        <source>OLD: %1 s</source>
        <translation>ALT: %1 s</translation>
    </message>
</context>
<context>
    <name>LiveLayout</name>
    <message>
        <source>Move {}</source>
        <translation>{} verschieben</translation>
    </message>
    <message>
        <source>Resize</source>
        <translation>Größe ändern</translation>
    </message>
    <message>
        <source>Move {} to a window</source>
        <translation>{} in ein Fenster</translation>
    </message>
    <message>
        <source>Move window {}</source>
        <translation>Fenster {} verschieben</translation>
    </message>
    <message>
        <source>Close window {}</source>
        <translation>Fenster {} schließen</translation>
    </message>
    <message>
        <source>Rename {}</source>
        <translation>{} umbenennen</translation>
    </message>
    <message>
        <source>Remove {}</source>
        <translation>{} entfernen</translation>
    </message>
    <message>
        <source>Move page {}</source>
        <translation>Seite {} verschieben</translation>
    </message>
    <message>
        <source>Page {}</source>
        <translation>Seite {}</translation>
    </message>
    <message>
        <source>Add a page</source>
        <translation>Seite hinzufügen</translation>
    </message>
    <message>
        <source>This was written by hand: change it in the text of the layout</source>
        <translation>Von Hand geschrieben: im Text des Layouts ändern</translation>
    </message>
</context>
<context>
    <name>LogView</name>
    <message>
        <source>D</source>
        <translation>D</translation>
    </message>
    <message>
        <source>I</source>
        <translation>I</translation>
    </message>
    <message>
        <source>W</source>
        <translation>W</translation>
    </message>
    <message>
        <source>E</source>
        <translation>E</translation>
    </message>
    <message>
        <source>F</source>
        <translation>F</translation>
    </message>
    <message>
        <source>debug</source>
        <translation>Debug</translation>
    </message>
    <message>
        <source>info</source>
        <translation>Info</translation>
    </message>
    <message>
        <source>warning</source>
        <translation>Warnung</translation>
    </message>
    <message>
        <source>error</source>
        <translation>Fehler</translation>
    </message>
    <message>
        <source>fatal</source>
        <translation>fatal</translation>
    </message>
    <message>
        <source>Log</source>
        <translation>Log</translation>
    </message>
    <message>
        <source>PAUSED · %1 new</source>
        <translation>PAUSE · %1 neu</translation>
    </message>
    <message>
        <source>%1 messages</source>
        <translation>%1 Nachrichten</translation>
    </message>
    <message>
        <source>show from %1, %2 messages</source>
        <translation>ab %1 zeigen, %2 Nachrichten</translation>
    </message>
    <message>
        <source>node</source>
        <translation>Knoten</translation>
    </message>
    <message>
        <source>show nodes with</source>
        <translation>Knoten mit</translation>
    </message>
    <message>
        <source>text</source>
        <translation>Text</translation>
    </message>
    <message>
        <source>show texts with</source>
        <translation>Texte mit</translation>
    </message>
    <message>
        <source>Resume</source>
        <translation>Weiter</translation>
    </message>
    <message>
        <source>Pause</source>
        <translation>Pause</translation>
    </message>
    <message>
        <source>Copy row</source>
        <translation>Zeile kopieren</translation>
    </message>
    <message>
        <source>Copy all</source>
        <translation>Alles kopieren</translation>
    </message>
    <message>
        <source>Clear</source>
        <translation>Leeren</translation>
    </message>
    <message>
        <source>%1 filtered out</source>
        <translation>%1 ausgefiltert</translation>
    </message>
    <message>
        <source>%1 older ones removed</source>
        <translation>%1 ältere entfernt</translation>
    </message>
    <message>
        <source>%1 lost</source>
        <translation>%1 verloren</translation>
    </message>
</context>
<context>
    <name>MapGoals</name>
    <message>
        <source>not sent: the frame of the map is not known</source>
        <translation>nicht gesendet: der Frame der Karte ist unbekannt</translation>
    </message>
    <message>
        <source>not sent: %1, %2, %3 is not a pose</source>
        <translation>nicht gesendet: %1, %2, %3 ist keine Pose</translation>
    </message>
    <message>
        <source>not sent: there are no waypoints</source>
        <translation>nicht gesendet: keine Wegpunkte</translation>
    </message>
    <message>
        <source>not sent: no server of FollowWaypoints or NavigateThroughPoses</source>
        <translation>nicht gesendet: kein Server für FollowWaypoints oder NavigateThroughPoses</translation>
    </message>
    <message>
        <source>the pose was sent to %1</source>
        <translation>Pose an %1 gesendet</translation>
    </message>
    <message>
        <source>the pose was not sent: %1</source>
        <translation>Pose nicht gesendet: %1</translation>
    </message>
    <message>
        <source>no connection</source>
        <translation>keine Verbindung</translation>
    </message>
    <message>
        <source>not sent: there is no navigation action, and %1 has no subscriber</source>
        <translation>nicht gesendet: keine Navigations-Action, und %1 hat keinen Subscriber</translation>
    </message>
    <message>
        <source>not sent: %1</source>
        <translation>nicht gesendet: %1</translation>
    </message>
    <message>
        <source>the goal was sent to %1, which reports nothing back</source>
        <translation>Ziel an %1 gesendet, das nichts zurückmeldet</translation>
    </message>
    <message>
        <source>sending …</source>
        <translation>sendet …</translation>
    </message>
    <message>
        <source>accepted</source>
        <translation>angenommen</translation>
    </message>
    <message>
        <source>not cancelled: %1</source>
        <translation>nicht abgebrochen: %1</translation>
    </message>
    <message>
        <source>waypoint %1 of %2</source>
        <translation>Wegpunkt %1 von %2</translation>
    </message>
    <message>
        <source>%1 m left</source>
        <translation>noch %1 m</translation>
    </message>
    <message>
        <source>driving</source>
        <translation>fährt</translation>
    </message>
    <message>
        <source>reached, without %1 of the waypoints</source>
        <translation>erreicht, ohne %1 der Wegpunkte</translation>
    </message>
    <message>
        <source>reached</source>
        <translation>erreicht</translation>
    </message>
    <message>
        <source>cancelled</source>
        <translation>abgebrochen</translation>
    </message>
    <message>
        <source>refused: %1</source>
        <translation>abgelehnt: %1</translation>
    </message>
    <message>
        <source>not reached: %1</source>
        <translation>nicht erreicht: %1</translation>
    </message>
    <message>
        <source>not reached</source>
        <translation>nicht erreicht</translation>
    </message>
    <message>
        <source>outcome unknown: %1</source>
        <translation>Ausgang unbekannt: %1</translation>
    </message>
    <message>
        <source>the goal of the other robot goes on</source>
        <translation>das Ziel des anderen Roboters läuft weiter</translation>
    </message>
    <message>
        <source>cancelling …</source>
        <translation>bricht ab …</translation>
    </message>
</context>
<context>
    <name>MapScale</name>
    <message>
        <source>%1 km</source>
        <translation>%1 km</translation>
    </message>
    <message>
        <source>%1 m</source>
        <translation>%1 m</translation>
    </message>
    <message>
        <source>%1 cm</source>
        <translation>%1 cm</translation>
    </message>
</context>
<context>
    <name>MapTools</name>
    <message>
        <source>Tools</source>
        <translation>Werkzeuge</translation>
    </message>
</context>
<context>
    <name>MapView</name>
    <message>
        <source>there are 100 waypoints already</source>
        <translation>es gibt schon 100 Wegpunkte</translation>
    </message>
    <message>
        <source>Map</source>
        <translation>Karte</translation>
    </message>
    <message>
        <source>%1 m driven</source>
        <translation>%1 m gefahren</translation>
    </message>
    <message>
        <source>Fit</source>
        <translation>Einpassen</translation>
    </message>
    <message>
        <source>Follow</source>
        <translation>Folgen</translation>
    </message>
    <message>
        <source>Goal</source>
        <translation>Ziel</translation>
    </message>
    <message>
        <source>Waypoints</source>
        <translation>Wegpunkte</translation>
    </message>
    <message>
        <source>Drive %1</source>
        <translation>%1 fahren</translation>
    </message>
    <message>
        <source>Pose</source>
        <translation>Pose</translation>
    </message>
    <message>
        <source>Layers</source>
        <translation>Ebenen</translation>
    </message>
    <message>
        <source>Cancel goal</source>
        <translation>Ziel abbrechen</translation>
    </message>
    <message>
        <source>press at the goal, drag to its heading</source>
        <translation>am Ziel drücken, in Blickrichtung ziehen</translation>
    </message>
    <message>
        <source>press where the robot is, drag to its heading</source>
        <translation>beim Roboter drücken, in Blickrichtung ziehen</translation>
    </message>
    <message>
        <source>press and drag for each waypoint</source>
        <translation>für jeden Wegpunkt drücken und ziehen</translation>
    </message>
    <message>
        <source>Goal: %1</source>
        <translation>Ziel: %1</translation>
    </message>
    <message>
        <source>%1 more topics; name those to show</source>
        <translation>%1 weitere Topics; die gewünschten benennen</translation>
    </message>
</context>
<context>
    <name>MessageContentEditor</name>
    <message>
        <source>Add an element</source>
        <translation>Element hinzufügen</translation>
    </message>
    <message>
        <source>Remove this element</source>
        <translation>Dieses Element entfernen</translation>
    </message>
</context>
<context>
    <name>MessageForm</name>
    <message>
        <source>Fields of %1</source>
        <translation>Felder von %1</translation>
    </message>
    <message>
        <source>Fields</source>
        <translation>Felder</translation>
    </message>
    <message>
        <source>Sent before</source>
        <translation>Zuletzt gesendet</translation>
    </message>
    <message>
        <source>sent before</source>
        <translation>zuletzt gesendet</translation>
    </message>
    <message>
        <source>nothing sent yet</source>
        <translation>noch nichts gesendet</translation>
    </message>
    <message>
        <source>Favourites</source>
        <translation>Favoriten</translation>
    </message>
    <message>
        <source>favourites</source>
        <translation>Favoriten</translation>
    </message>
    <message>
        <source>Keep as a favourite</source>
        <translation>Als Favorit merken</translation>
    </message>
    <message>
        <source>Give all fields their defaults</source>
        <translation>Alle Felder auf Vorgabe</translation>
    </message>
    <message>
        <source>name of the favourite, Enter keeps it</source>
        <translation>Name des Favoriten, Enter merkt ihn</translation>
    </message>
    <message>
        <source>Forget %1</source>
        <translation>%1 vergessen</translation>
    </message>
    <message>
        <source>no type is given</source>
        <translation>kein Typ angegeben</translation>
    </message>
    <message>
        <source>%1 has no fields</source>
        <translation>%1 hat keine Felder</translation>
    </message>
    <message>
        <source>outside of %1, which the comment names</source>
        <translation>außerhalb von %1, laut Kommentar</translation>
    </message>
    <message>
        <source>%1 in %2</source>
        <translation>%1 in %2</translation>
    </message>
    <message>
        <source>Fold %1</source>
        <translation>%1 zuklappen</translation>
    </message>
    <message>
        <source>Unfold %1</source>
        <translation>%1 aufklappen</translation>
    </message>
    <message>
        <source>%1 (%2)</source>
        <translation>%1 (%2)</translation>
    </message>
    <message>
        <source>%1  %2</source>
        <translation>%1  %2</translation>
    </message>
    <message>
        <source>a long text, which is kept</source>
        <translation>ein langer Text, der so bleibt</translation>
    </message>
    <message>
        <source>now</source>
        <translation>jetzt</translation>
    </message>
    <message>
        <source>Set %1 to the current time when it is sent</source>
        <translation>%1 beim Senden auf die aktuelle Zeit setzen</translation>
    </message>
    <message>
        <source>Move %1 up</source>
        <translation>%1 nach oben</translation>
    </message>
    <message>
        <source>Move %1 down</source>
        <translation>%1 nach unten</translation>
    </message>
    <message>
        <source>Remove %1</source>
        <translation>%1 entfernen</translation>
    </message>
    <message>
        <source>Add an element to %1</source>
        <translation>Element zu %1 hinzufügen</translation>
    </message>
</context>
<context>
    <name>MessageView</name>
    <message>
        <source>Not sent: %1</source>
        <translation>Nicht gesendet: %1</translation>
    </message>
    <message>
        <source>the robot is not connected</source>
        <translation>der Roboter ist nicht verbunden</translation>
    </message>
    <message>
        <source>Being sent.</source>
        <translation>Wird gesendet.</translation>
    </message>
    <message>
        <source>Sent; there is no subscriber.</source>
        <translation>Gesendet; es gibt keinen Subscriber.</translation>
    </message>
    <message>
        <source>Sent to %1 subscribers.</source>
        <translation>An %1 Subscriber gesendet.</translation>
    </message>
    <message>
        <source>Message</source>
        <translation>Nachricht</translation>
    </message>
    <message>
        <source>EDITED</source>
        <translation>BEARBEITET</translation>
    </message>
    <message>
        <source>%1 Hz</source>
        <translation>%1 Hz</translation>
    </message>
    <message>
        <source>No topic is selected.</source>
        <translation>Kein Topic gewählt.</translation>
    </message>
    <message>
        <source>%1  %2</source>
        <translation>%1  %2</translation>
    </message>
    <message>
        <source>Edit</source>
        <translation>Bearbeiten</translation>
    </message>
    <message>
        <source>Publish once</source>
        <translation>Einmal senden</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>%1: %2 %3</source>
        <translation>%1: %2 %3</translation>
    </message>
    <message>
        <source>%1 %2</source>
        <translation>%1 %2</translation>
    </message>
</context>
<context>
    <name>ModeSwitch</name>
    <message>
        <source>unconfigured</source>
        <translation>unkonfiguriert</translation>
    </message>
    <message>
        <source>inactive</source>
        <translation>inaktiv</translation>
    </message>
    <message>
        <source>active</source>
        <translation>aktiv</translation>
    </message>
    <message>
        <source>finalized</source>
        <translation>beendet</translation>
    </message>
    <message>
        <source>Mode</source>
        <translation>Modus</translation>
    </message>
    <message>
        <source>confirmed: %1</source>
        <translation>bestätigt: %1</translation>
    </message>
    <message>
        <source>%1 has the type %2, which is not a String or an integer</source>
        <translation>%1 hat den Typ %2, nicht String oder Ganzzahl</translation>
    </message>
    <message>
        <source>not sent: no connection</source>
        <translation>nicht gesendet: keine Verbindung</translation>
    </message>
    <message>
        <source>refused: %1</source>
        <translation>abgelehnt: %1</translation>
    </message>
    <message>
        <source>refused</source>
        <translation>abgelehnt</translation>
    </message>
    <message>
        <source>the node&apos;s state is unknown</source>
        <translation>der Zustand des Knotens ist unbekannt</translation>
    </message>
    <message>
        <source>no transition leads from %1 to %2</source>
        <translation>kein Übergang führt von %1 nach %2</translation>
    </message>
    <message>
        <source>refused: %1 did not become %2</source>
        <translation>abgelehnt: %1 wurde nicht %2</translation>
    </message>
    <message>
        <source>%1 was requested, and not confirmed within %2 s</source>
        <translation>%1 angefordert, in %2 s nicht bestätigt</translation>
    </message>
    <message>
        <source>confirmed</source>
        <translation>bestätigt</translation>
    </message>
    <message>
        <source>requested</source>
        <translation>angefordert</translation>
    </message>
    <message>
        <source>%1 requested, not confirmed yet</source>
        <translation>%1 angefordert, noch nicht bestätigt</translation>
    </message>
</context>
<context>
    <name>NodeGraph</name>
    <message>
        <source>Nodes and topics</source>
        <translation>Knoten und Topics</translation>
    </message>
    <message>
        <source>%1 not shown: enter a filter</source>
        <translation>%1 nicht gezeigt: Filter eingeben</translation>
    </message>
    <message>
        <source>%1 shown</source>
        <translation>%1 gezeigt</translation>
    </message>
    <message>
        <source>Filter by name</source>
        <translation>Nach Namen filtern</translation>
    </message>
    <message>
        <source>Fit</source>
        <translation>Einpassen</translation>
    </message>
    <message>
        <source>Show all of the graph</source>
        <translation>Ganzen Graphen zeigen</translation>
    </message>
    <message>
        <source>Too many connections to draw: enter a filter.</source>
        <translation>Zu viele Verbindungen: Filter eingeben.</translation>
    </message>
    <message>
        <source>No node or topic matches the filter.</source>
        <translation>Kein Knoten oder Topic passt zum Filter.</translation>
    </message>
    <message>
        <source>There are no nodes yet.</source>
        <translation>Es gibt noch keine Knoten.</translation>
    </message>
</context>
<context>
    <name>OwnChanges</name>
    <message>
        <source>Settings of {}</source>
        <translation>Einstellungen von {}</translation>
    </message>
</context>
<context>
    <name>PageBar</name>
    <message>
        <source>Pages</source>
        <translation>Seiten</translation>
    </message>
    <message>
        <source>Page %1</source>
        <translation>Seite %1</translation>
    </message>
    <message>
        <source>Ctrl+%1</source>
        <translation>Strg+%1</translation>
    </message>
    <message>
        <source>Window</source>
        <translation>Fenster</translation>
    </message>
    <message>
        <source>Show the window %1 again</source>
        <translation>Fenster %1 wieder zeigen</translation>
    </message>
    <message>
        <source>Add a page</source>
        <translation>Seite hinzufügen</translation>
    </message>
</context>
<context>
    <name>PageEdit</name>
    <message>
        <source>Name of the page</source>
        <translation>Name der Seite</translation>
    </message>
</context>
<context>
    <name>Panel</name>
    <message>
        <source>Empty: choose what it shows from the list of panels, or drag a panel here.</source>
        <translation>Leer: aus der Liste der Panels wählen oder ein Panel hierher ziehen.</translation>
    </message>
    <message>
        <source>This panel is empty. Edit the layout to say what it shows.</source>
        <translation>Dieses Panel ist leer. Beim Bearbeiten des Layouts den Inhalt wählen.</translation>
    </message>
</context>
<context>
    <name>PanelButtons</name>
    <message>
        <source>Put the panel back</source>
        <translation>Panel andocken</translation>
    </message>
    <message>
        <source>Show the panel in a window of its own</source>
        <translation>Panel in eigenem Fenster zeigen</translation>
    </message>
    <message>
        <source>Restore the panel (F11)</source>
        <translation>Panel wiederherstellen (F11)</translation>
    </message>
    <message>
        <source>Maximise the panel (F11)</source>
        <translation>Panel maximieren (F11)</translation>
    </message>
    <message>
        <source>Menu of the panel (Shift+F10)</source>
        <translation>Menü des Panels (Umschalt+F10)</translation>
    </message>
</context>
<context>
    <name>PanelMenu</name>
    <message>
        <source>Restore</source>
        <translation>Wiederherstellen</translation>
    </message>
    <message>
        <source>Maximise</source>
        <translation>Maximieren</translation>
    </message>
    <message>
        <source>Put back</source>
        <translation>Andocken</translation>
    </message>
    <message>
        <source>Own window</source>
        <translation>Eigenes Fenster</translation>
    </message>
    <message>
        <source>Rename</source>
        <translation>Umbenennen</translation>
    </message>
    <message>
        <source>Resize by keys</source>
        <translation>Größe per Tasten</translation>
    </message>
    <message>
        <source>Move left</source>
        <translation>Nach links</translation>
    </message>
    <message>
        <source>Move right</source>
        <translation>Nach rechts</translation>
    </message>
    <message>
        <source>Ctrl+Shift+←</source>
        <translation>Strg+Umschalt+←</translation>
    </message>
    <message>
        <source>Ctrl+Shift+→</source>
        <translation>Strg+Umschalt+→</translation>
    </message>
    <message>
        <source>Move up</source>
        <translation>Nach oben</translation>
    </message>
    <message>
        <source>Move down</source>
        <translation>Nach unten</translation>
    </message>
    <message>
        <source>Ctrl+Shift+↑</source>
        <translation>Strg+Umschalt+↑</translation>
    </message>
    <message>
        <source>Ctrl+Shift+↓</source>
        <translation>Strg+Umschalt+↓</translation>
    </message>
    <message>
        <source>Move to %1</source>
        <translation>Nach %1</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Entfernen</translation>
    </message>
    <message>
        <source>Del</source>
        <translation>Entf</translation>
    </message>
    <message>
        <source>Help</source>
        <translation>Hilfe</translation>
    </message>
    <message>
        <source>Menu of %1</source>
        <translation>Menü von %1</translation>
    </message>
</context>
<context>
    <name>PanelTitle</name>
    <message>
        <source>Title</source>
        <translation>Titel</translation>
    </message>
</context>
<context>
    <name>PanelWindow</name>
    <message>
        <source>The screen %1 is not there: shown on %2</source>
        <translation>Bildschirm %1 fehlt: gezeigt auf %2</translation>
    </message>
    <message>
        <source>the primary screen</source>
        <translation>dem Hauptbildschirm</translation>
    </message>
</context>
<context>
    <name>ParameterForm</name>
    <message>
        <source>Parameters of %1</source>
        <translation>Parameter von %1</translation>
    </message>
    <message>
        <source>Parameters</source>
        <translation>Parameter</translation>
    </message>
    <message>
        <source>NOT AVAILABLE: these values are old</source>
        <translation>NICHT VERFÜGBAR: diese Werte sind alt</translation>
    </message>
    <message>
        <source>waiting for %1</source>
        <translation>wartet auf %1</translation>
    </message>
    <message>
        <source>%1 of %2</source>
        <translation>%1 von %2</translation>
    </message>
    <message>
        <source>Node</source>
        <translation>Knoten</translation>
    </message>
    <message>
        <source>choose a node</source>
        <translation>Knoten wählen</translation>
    </message>
    <message>
        <source>search</source>
        <translation>suchen</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>no node is chosen</source>
        <translation>kein Knoten gewählt</translation>
    </message>
    <message>
        <source>no name contains the text searched for</source>
        <translation>kein Name enthält den gesuchten Text</translation>
    </message>
    <message>
        <source>this node has no parameters</source>
        <translation>dieser Knoten hat keine Parameter</translation>
    </message>
    <message>
        <source>REFUSED: %1</source>
        <translation>ABGELEHNT: %1</translation>
    </message>
    <message>
        <source>changed by the robot or another client</source>
        <translation>vom Roboter oder anderswo geändert</translation>
    </message>
    <message>
        <source>not set</source>
        <translation>nicht gesetzt</translation>
    </message>
    <message>
        <source>%1, read-only: %2</source>
        <translation>%1, nur lesbar: %2</translation>
    </message>
</context>
<context>
    <name>Plot</name>
    <message>
        <source>%1 could not be written</source>
        <translation>%1 ließ sich nicht schreiben</translation>
    </message>
    <message>
        <source>%1: the plot is not on the screen</source>
        <translation>%1: der Plot ist nicht zu sehen</translation>
    </message>
    <message>
        <source>Plot</source>
        <translation>Plot</translation>
    </message>
    <message>
        <source>PAUSED, %1 s ago</source>
        <translation>PAUSE, vor %1 s</translation>
    </message>
    <message>
        <source>PAUSED</source>
        <translation>PAUSE</translation>
    </message>
    <message>
        <source>reading, %1 %</source>
        <translation>liest, %1 %</translation>
    </message>
    <message>
        <source>extremes of %1 samples</source>
        <translation>Extreme aus %1 Werten</translation>
    </message>
    <message>
        <source>%1 lost</source>
        <translation>%1 verloren</translation>
    </message>
    <message>
        <source>Remove %1</source>
        <translation>%1 entfernen</translation>
    </message>
    <message>
        <source>and %1 more</source>
        <translation>und %1 weitere</translation>
    </message>
    <message>
        <source>Set paths, e.g. &quot;/odom:twist.twist.linear.x&quot;, or drop a field here</source>
        <translation>paths setzen, z. B. &quot;/odom:twist.twist.linear.x&quot;, oder ein Feld hier ablegen</translation>
    </message>
    <message>
        <source>Live</source>
        <translation>Live</translation>
    </message>
    <message>
        <source>Pause</source>
        <translation>Pause</translation>
    </message>
    <message>
        <source>Show less time</source>
        <translation>Weniger Zeit zeigen</translation>
    </message>
    <message>
        <source>Show more time</source>
        <translation>Mehr Zeit zeigen</translation>
    </message>
    <message>
        <source>Fit</source>
        <translation>Einpassen</translation>
    </message>
    <message>
        <source>Fit the axes to the data</source>
        <translation>Achsen an die Daten anpassen</translation>
    </message>
    <message>
        <source>CSV</source>
        <translation>CSV</translation>
    </message>
    <message>
        <source>Save as CSV</source>
        <translation>Als CSV speichern</translation>
    </message>
    <message>
        <source>PNG</source>
        <translation>PNG</translation>
    </message>
    <message>
        <source>Save as PNG</source>
        <translation>Als PNG speichern</translation>
    </message>
    <message>
        <source>%1 s are shown</source>
        <translation>%1 s gezeigt</translation>
    </message>
</context>
<context>
    <name>PlotWindow</name>
    <message>
        <source>Plot of %1</source>
        <translation>Plot von %1</translation>
    </message>
    <message>
        <source>Plot</source>
        <translation>Plot</translation>
    </message>
    <message>
        <source>%1 was written</source>
        <translation>%1 geschrieben</translation>
    </message>
</context>
<context>
    <name>Plugin</name>
    <message>
        <source>%1 errors in this plugin, the last: </source>
        <translation>%1 Fehler in diesem Plugin, der letzte: </translation>
    </message>
    <message>
        <source>An error in this plugin: </source>
        <translation>Ein Fehler in diesem Plugin: </translation>
    </message>
    <message>
        <source>Hide</source>
        <translation>Ausblenden</translation>
    </message>
    <message>
        <source>This plugin cannot be shown.
%1</source>
        <translation>Dieses Plugin lässt sich nicht zeigen.
%1</translation>
    </message>
    <message>
        <source>This plugin was stopped, so that the other panels live on.
%1</source>
        <translation>Dieses Plugin wurde angehalten, damit die anderen Panels weiterlaufen.
%1</translation>
    </message>
    <message>
        <source>Waiting for the robot ...</source>
        <translation>Wartet auf den Roboter …</translation>
    </message>
    <message>
        <source>Set source to the file of a plugin of RQml, or to its id.</source>
        <translation>source auf die Datei eines RQml-Plugins oder dessen id setzen.</translation>
    </message>
    <message>
        <source>Load again</source>
        <translation>Neu laden</translation>
    </message>
</context>
<context>
    <name>PropertyBox</name>
    <message>
        <source>The selected panel</source>
        <translation>Das gewählte Panel</translation>
    </message>
    <message>
        <source>Title of the panel</source>
        <translation>Titel des Panels</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Entfernen</translation>
    </message>
</context>
<context>
    <name>PropertyForm</name>
    <message>
        <source>Properties of %1</source>
        <translation>Eigenschaften von %1</translation>
    </message>
    <message>
        <source>Properties</source>
        <translation>Eigenschaften</translation>
    </message>
    <message>
        <source>No panel is selected</source>
        <translation>Kein Panel gewählt</translation>
    </message>
    <message>
        <source>Help about %1</source>
        <translation>Hilfe zu %1</translation>
    </message>
    <message>
        <source>search %1 properties</source>
        <translation>%1 Eigenschaften durchsuchen</translation>
    </message>
    <message>
        <source>no property is similar to the text</source>
        <translation>keine Eigenschaft ähnelt dem Text</translation>
    </message>
    <message>
        <source>from %1 on</source>
        <translation>ab %1</translation>
    </message>
    <message>
        <source>Reset %1 to its default</source>
        <translation>%1 auf Vorgabe zurücksetzen</translation>
    </message>
    <message>
        <source>NOT CHANGED: %1</source>
        <translation>NICHT GEÄNDERT: %1</translation>
    </message>
    <message>
        <source>A value replaces the binding: %1</source>
        <translation>Ein Wert ersetzt die Bindung: %1</translation>
    </message>
    <message>
        <source>default: %1</source>
        <translation>Vorgabe: %1</translation>
    </message>
    <message>
        <source>bound: %1</source>
        <translation>gebunden: %1</translation>
    </message>
    <message>
        <source>Replace ...</source>
        <translation>Ersetzen …</translation>
    </message>
    <message>
        <source>The binding of %1 is replaced by a value</source>
        <translation>Die Bindung von %1 wird durch einen Wert ersetzt</translation>
    </message>
    <message>
        <source>found by type</source>
        <translation>nach Typ gefunden</translation>
    </message>
</context>
<context>
    <name>PublishPanel</name>
    <message>
        <source>%1 is not repeated: steer by a TwistCommand, which stops when it is let go</source>
        <translation>%1 wird nicht wiederholt: mit TwistCommand steuern, das beim Loslassen anhält</translation>
    </message>
    <message>
        <source>stopped after %1</source>
        <translation>nach %1 angehalten</translation>
    </message>
    <message>
        <source>the message is not complete</source>
        <translation>die Nachricht ist nicht vollständig</translation>
    </message>
    <message>
        <source>no topic of a known type is given</source>
        <translation>kein Topic bekannten Typs angegeben</translation>
    </message>
    <message>
        <source>NOT SENT: %1</source>
        <translation>NICHT GESENDET: %1</translation>
    </message>
    <message>
        <source>the robot is not connected</source>
        <translation>der Roboter ist nicht verbunden</translation>
    </message>
    <message>
        <source>sent to 1 subscriber</source>
        <translation>an 1 Subscriber gesendet</translation>
    </message>
    <message>
        <source>sent to %1 subscribers</source>
        <translation>an %1 Subscriber gesendet</translation>
    </message>
    <message>
        <source>sent; there is no subscriber</source>
        <translation>gesendet; kein Subscriber</translation>
    </message>
    <message>
        <source>being sent</source>
        <translation>wird gesendet</translation>
    </message>
    <message>
        <source>Publish %1</source>
        <translation>%1 senden</translation>
    </message>
    <message>
        <source>Publish</source>
        <translation>Senden</translation>
    </message>
    <message>
        <source>PUBLISHING %1 Hz · %2</source>
        <translation>SENDET %1 Hz · %2</translation>
    </message>
    <message>
        <source>%1 sent</source>
        <translation>%1 gesendet</translation>
    </message>
    <message>
        <source>STOPPED: %1</source>
        <translation>ANGEHALTEN: %1</translation>
    </message>
    <message>
        <source>topic</source>
        <translation>Topic</translation>
    </message>
    <message>
        <source>Topic</source>
        <translation>Topic</translation>
    </message>
    <message>
        <source>the type of %1 is not known yet: set `type`</source>
        <translation>der Typ von %1 ist noch nicht bekannt: `type` setzen</translation>
    </message>
    <message>
        <source>Enter a topic, or set `topic`.</source>
        <translation>Topic eingeben oder `topic` setzen.</translation>
    </message>
    <message>
        <source>This moves the robot, and nothing stops it again. To drive, use a TwistCommand (DriveStick, DriveKeys).</source>
        <translation>Das bewegt den Roboter, und nichts hält ihn wieder an. Zum Fahren TwistCommand nehmen (DriveStick, DriveKeys).</translation>
    </message>
    <message>
        <source>Publish once</source>
        <translation>Einmal senden</translation>
    </message>
    <message>
        <source>Hold to publish once</source>
        <translation>Zum Senden halten</translation>
    </message>
    <message>
        <source>STOP</source>
        <translation>STOPP</translation>
    </message>
    <message>
        <source>Repeat at %1 Hz</source>
        <translation>Mit %1 Hz wiederholen</translation>
    </message>
</context>
<context>
    <name>Recorder</name>
    <message>
        <source>Mark</source>
        <translation>Marke</translation>
    </message>
    <message>
        <source>Recorder</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>%1 free</source>
        <translation>%1 frei</translation>
    </message>
    <message>
        <source>Stop</source>
        <translation>Stopp</translation>
    </message>
    <message>
        <source>saving ...</source>
        <translation>speichert …</translation>
    </message>
    <message>
        <source>Record</source>
        <translation>Aufnehmen</translation>
    </message>
    <message>
        <source>Write an event mark: %1</source>
        <translation>Marke setzen: %1</translation>
    </message>
    <message>
        <source>starting ...</source>
        <translation>startet …</translation>
    </message>
    <message>
        <source>not recording</source>
        <translation>keine Aufnahme</translation>
    </message>
    <message>
        <source>at most %1</source>
        <translation>höchstens %1</translation>
    </message>
    <message>
        <source>%1 messages</source>
        <translation>%1 Nachrichten</translation>
    </message>
    <message>
        <source>%1 marks</source>
        <translation>%1 Marken</translation>
    </message>
    <message>
        <source>%1 LOST: the disk is too slow</source>
        <translation>%1 VERLOREN: Datenträger zu langsam</translation>
    </message>
    <message>
        <source>completing %1</source>
        <translation>schließt %1 ab</translation>
    </message>
    <message>
        <source>%1: %2</source>
        <translation>%1: %2</translation>
    </message>
    <message>
        <source>DISK NEARLY FULL: %1 free</source>
        <translation>DATENTRÄGER FAST VOLL: %1 frei</translation>
    </message>
    <message>
        <source>not recorded: %1</source>
        <translation>nicht aufgenommen: %1</translation>
    </message>
</context>
<context>
    <name>RecordingStrip</name>
    <message>
        <source>nothing is being recorded</source>
        <translation>es wird nichts aufgenommen</translation>
    </message>
    <message>
        <source>Mark</source>
        <translation>Marke</translation>
    </message>
    <message>
        <source>mark %1 written</source>
        <translation>Marke %1 gesetzt</translation>
    </message>
    <message>
        <source>Recording</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>Recorder</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>recorded to %1</source>
        <translation>aufgenommen in %1</translation>
    </message>
    <message>
        <source>ends at</source>
        <translation>endet bei</translation>
    </message>
    <message>
        <source>Size at which the recording ends</source>
        <translation>Größe, bei der die Aufnahme endet</translation>
    </message>
    <message>
        <source>1 GB</source>
        <translation>1 GB</translation>
    </message>
    <message>
        <source>4 GB</source>
        <translation>4 GB</translation>
    </message>
    <message>
        <source>16 GB</source>
        <translation>16 GB</translation>
    </message>
    <message>
        <source>64 GB</source>
        <translation>64 GB</translation>
    </message>
    <message>
        <source>no limit</source>
        <translation>ohne Grenze</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
</context>
<context>
    <name>RefreshButton</name>
    <message>
        <source>Refresh</source>
        <translation>Aktualisieren</translation>
    </message>
</context>
<context>
    <name>RobotSwitch</name>
    <message>
        <source>Robot</source>
        <translation>Roboter</translation>
    </message>
    <message>
        <source>%1 robots</source>
        <translation>%1 Roboter</translation>
    </message>
    <message>
        <source>(no namespace)</source>
        <translation>(kein Namespace)</translation>
    </message>
    <message>
        <source>%1 robots of this name: that many nodes are called %2</source>
        <translation>%1 Roboter dieses Namens: so viele Knoten heißen %2</translation>
    </message>
    <message>
        <source>no robot</source>
        <translation>kein Roboter</translation>
    </message>
    <message>
        <source>%1 is not there</source>
        <translation>%1 ist nicht da</translation>
    </message>
    <message>
        <source>(gone)</source>
        <translation>(weg)</translation>
    </message>
    <message>
        <source>gone</source>
        <translation>weg</translation>
    </message>
</context>
<context>
    <name>RobotTiles</name>
    <message>
        <source>Robots</source>
        <translation>Roboter</translation>
    </message>
    <message>
        <source>no robot: no namespace has %1</source>
        <translation>kein Roboter: kein Namespace hat %1</translation>
    </message>
    <message>
        <source>1 robot</source>
        <translation>1 Roboter</translation>
    </message>
    <message>
        <source>%1 robots</source>
        <translation>%1 Roboter</translation>
    </message>
    <message>
        <source>%1 in trouble</source>
        <translation>%1 gestört</translation>
    </message>
    <message>
        <source>%1 not shown</source>
        <translation>%1 nicht gezeigt</translation>
    </message>
    <message>
        <source>no battery</source>
        <translation>keine Batterie</translation>
    </message>
    <message>
        <source>? %</source>
        <translation>? %</translation>
    </message>
    <message>
        <source>%1 %, OLD</source>
        <translation>%1 %, ALT</translation>
    </message>
    <message>
        <source>%1 %</source>
        <translation>%1 %</translation>
    </message>
    <message>
        <source>no diagnostics</source>
        <translation>keine Diagnose</translation>
    </message>
    <message>
        <source>diagnostics: none yet</source>
        <translation>Diagnose: noch keine</translation>
    </message>
    <message>
        <source>diagnostics silent</source>
        <translation>Diagnose stumm</translation>
    </message>
    <message>
        <source>1 error</source>
        <translation>1 Fehler</translation>
    </message>
    <message>
        <source>%1 errors</source>
        <translation>%1 Fehler</translation>
    </message>
    <message>
        <source>%1 silent</source>
        <translation>%1 stumm</translation>
    </message>
    <message>
        <source>1 warning</source>
        <translation>1 Warnung</translation>
    </message>
    <message>
        <source>%1 warnings</source>
        <translation>%1 Warnungen</translation>
    </message>
    <message>
        <source>no alarm</source>
        <translation>kein Alarm</translation>
    </message>
    <message>
        <source>selected</source>
        <translation>gewählt</translation>
    </message>
    <message>
        <source>TWO OF THIS NAME</source>
        <translation>NAME DOPPELT</translation>
    </message>
    <message>
        <source>GONE</source>
        <translation>WEG</translation>
    </message>
    <message>
        <source>nothing to show</source>
        <translation>nichts zu zeigen</translation>
    </message>
    <message>
        <source>%1 s</source>
        <translation>%1 s</translation>
    </message>
    <message>
        <source>no camera</source>
        <translation>keine Kamera</translation>
    </message>
</context>
<context>
    <name>SearchBar</name>
    <message>
        <source>Search...</source>
        <translation>Suchen …</translation>
    </message>
    <message>
        <source>Clear</source>
        <translation>Löschen</translation>
    </message>
    <message>
        <source>Last match (Shift+Enter)</source>
        <translation>Voriger Treffer (Umschalt+Enter)</translation>
    </message>
    <message>
        <source>Next match (Enter)</source>
        <translation>Nächster Treffer (Enter)</translation>
    </message>
</context>
<context>
    <name>ServiceButton</name>
    <message>
        <source>calling ...</source>
        <translation>Aufruf läuft …</translation>
    </message>
    <message>
        <source>waiting for %1 ...</source>
        <translation>wartet auf %1 …</translation>
    </message>
    <message>
        <source>FAILED: %1</source>
        <translation>FEHLGESCHLAGEN: %1</translation>
    </message>
    <message>
        <source>NOT AVAILABLE: %1</source>
        <translation>NICHT VERFÜGBAR: %1</translation>
    </message>
    <message>
        <source>no server of %1 yet</source>
        <translation>noch kein Server für %1</translation>
    </message>
    <message>
        <source>REFUSED: %1</source>
        <translation>ABGELEHNT: %1</translation>
    </message>
    <message>
        <source>done: %1</source>
        <translation>fertig: %1</translation>
    </message>
    <message>
        <source>done</source>
        <translation>fertig</translation>
    </message>
    <message>
        <source>its answer could not be judged: %1</source>
        <translation>Antwort nicht auswertbar: %1</translation>
    </message>
    <message>
        <source>the service was changed before it answered</source>
        <translation>der Dienst wurde vor der Antwort gewechselt</translation>
    </message>
    <message>
        <source>no service is given</source>
        <translation>kein Dienst angegeben</translation>
    </message>
    <message>
        <source>no answer within %1 s; the robot may still do it</source>
        <translation>keine Antwort in %1 s; der Roboter tut es womöglich noch</translation>
    </message>
    <message>
        <source>no server of %1 within %2 s</source>
        <translation>kein Server für %1 in %2 s</translation>
    </message>
    <message>
        <source>%1 ...</source>
        <translation>%1 …</translation>
    </message>
</context>
<context>
    <name>Speed</name>
    <message>
        <source>unit is &quot;m/s&quot; or &quot;km/h&quot;, not &quot;%1&quot;</source>
        <translation>unit ist &quot;m/s&quot; oder &quot;km/h&quot;, nicht &quot;%1&quot;</translation>
    </message>
    <message>
        <source>turnUnit is &quot;°/s&quot; or &quot;rad/s&quot;, not &quot;%1&quot;</source>
        <translation>turnUnit ist &quot;°/s&quot; oder &quot;rad/s&quot;, nicht &quot;%1&quot;</translation>
    </message>
    <message>
        <source>linear.x is not a number</source>
        <translation>linear.x ist keine Zahl</translation>
    </message>
    <message>
        <source>linear.y is not a number</source>
        <translation>linear.y ist keine Zahl</translation>
    </message>
    <message>
        <source>angular.z is not a number</source>
        <translation>angular.z ist keine Zahl</translation>
    </message>
    <message>
        <source>?</source>
        <translation>?</translation>
    </message>
    <message>
        <source>Speed</source>
        <translation>Tempo</translation>
    </message>
    <message>
        <source>not driving: %1</source>
        <translation>fährt nicht: %1</translation>
    </message>
    <message>
        <source>%1 right</source>
        <translation>%1 rechts</translation>
    </message>
    <message>
        <source>%1 left</source>
        <translation>%1 links</translation>
    </message>
    <message>
        <source>NOT DRIVING: %1</source>
        <translation>FÄHRT NICHT: %1</translation>
    </message>
</context>
<context>
    <name>SpeedSlider</name>
    <message>
        <source>Highest speed</source>
        <translation>Höchsttempo</translation>
    </message>
    <message>
        <source>Zero</source>
        <translation>Null</translation>
    </message>
    <message>
        <source>Speed</source>
        <translation>Tempo</translation>
    </message>
    <message>
        <source>Lowest speed</source>
        <translation>Mindesttempo</translation>
    </message>
</context>
<context>
    <name>SplitHandles</name>
    <message>
        <source>Edge, moved by the up and down keys</source>
        <translation>Kante, mit Pfeil auf und ab bewegt</translation>
    </message>
    <message>
        <source>Edge, moved by the left and right keys</source>
        <translation>Kante, mit Pfeil links und rechts bewegt</translation>
    </message>
</context>
<context>
    <name>StartPage</name>
    <message>
        <source>Start</source>
        <translation>Start</translation>
    </message>
    <message>
        <source>Connected to %1</source>
        <translation>Verbunden mit %1</translation>
    </message>
    <message>
        <source>Which robot?</source>
        <translation>Welcher Roboter?</translation>
    </message>
    <message>
        <source>Connected</source>
        <translation>Verbunden</translation>
    </message>
    <message>
        <source>Connect</source>
        <translation>Verbinden</translation>
    </message>
    <message>
        <source>Connect to %1</source>
        <translation>Mit %1 verbinden</translation>
    </message>
    <message>
        <source>another address, e.g. zenoh://robot.local:7447, ros1://robot:11311</source>
        <translation>andere Adresse, z. B. zenoh://robot.local:7447, ros1://robot:11311</translation>
    </message>
    <message>
        <source>Searching …</source>
        <translation>Sucht …</translation>
    </message>
    <message>
        <source>Search again</source>
        <translation>Neu suchen</translation>
    </message>
    <message>
        <source>Open a recording …</source>
        <translation>Aufnahme öffnen …</translation>
    </message>
    <message>
        <source>Try it on a simulated robot</source>
        <translation>An simuliertem Roboter testen</translation>
    </message>
    <message>
        <source>This robot offers data for %1 panels</source>
        <translation>Dieser Roboter bietet Daten für %1 Panels</translation>
    </message>
    <message>
        <source>This recording has data for %1 panels</source>
        <translation>Diese Aufnahme hat Daten für %1 Panels</translation>
    </message>
    <message>
        <source>Show all</source>
        <translation>Alle zeigen</translation>
    </message>
    <message>
        <source>Layouts</source>
        <translation>Layouts</translation>
    </message>
    <message>
        <source>New, empty</source>
        <translation>Neu, leer</translation>
    </message>
    <message>
        <source>Open …</source>
        <translation>Öffnen …</translation>
    </message>
    <message>
        <source>Back to %1</source>
        <translation>Zurück zu %1</translation>
    </message>
    <message>
        <source>Open %1</source>
        <translation>%1 öffnen</translation>
    </message>
</context>
<context>
    <name>TabRow</name>
    <message>
        <source>Tabs</source>
        <translation>Reiter</translation>
    </message>
    <message>
        <source>Tab %1</source>
        <translation>Reiter %1</translation>
    </message>
</context>
<context>
    <name>TfTree</name>
    <message>
        <source>Transforms</source>
        <translation>Transformationen</translation>
    </message>
    <message>
        <source>%1 frames</source>
        <translation>%1 Frames</translation>
    </message>
    <message>
        <source>%1 of %2 frames</source>
        <translation>%1 von %2 Frames</translation>
    </message>
    <message>
        <source>%1 wrong</source>
        <translation>%1 falsch</translation>
    </message>
    <message>
        <source>%1 old</source>
        <translation>%1 alt</translation>
    </message>
    <message>
        <source>Filter by name</source>
        <translation>Nach Namen filtern</translation>
    </message>
    <message>
        <source>No frame matches the filter.</source>
        <translation>Kein Frame passt zum Filter.</translation>
    </message>
    <message>
        <source>static</source>
        <translation>statisch</translation>
    </message>
    <message>
        <source>OLD: %1 s</source>
        <translation>ALT: %1 s</translation>
    </message>
    <message>
        <source>%1 Hz · %2 s</source>
        <translation>%1 Hz · %2 s</translation>
    </message>
    <message>
        <source>%1 s</source>
        <translation>%1 s</translation>
    </message>
    <message>
        <source>WRONG</source>
        <translation>FALSCH</translation>
    </message>
</context>
<context>
    <name>ThemeHoldButton</name>
    <message>
        <source>Hold it down for %1 s</source>
        <translation>%1 s lang halten</translation>
    </message>
    <message>
        <source>hold ...</source>
        <translation>halten …</translation>
    </message>
</context>
<context>
    <name>ThemeList</name>
    <message>
        <source>%1 more below</source>
        <translation>%1 weitere unten</translation>
    </message>
</context>
<context>
    <name>Timeline</name>
    <message>
        <source>Recording</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>NO RECORDING YET</source>
        <translation>NOCH KEINE AUFNAHME</translation>
    </message>
    <message>
        <source>no recording is shown</source>
        <translation>keine Aufnahme gezeigt</translation>
    </message>
    <message>
        <source>playing, %1 x</source>
        <translation>spielt, %1 x</translation>
    </message>
    <message>
        <source>playing</source>
        <translation>spielt</translation>
    </message>
    <message>
        <source>PAUSED</source>
        <translation>PAUSE</translation>
    </message>
    <message>
        <source>%1 of %2</source>
        <translation>%1 von %2</translation>
    </message>
    <message>
        <source>Topics of the recording</source>
        <translation>Topics der Aufnahme</translation>
    </message>
    <message>
        <source>%1: %2 messages</source>
        <translation>%1: %2 Nachrichten</translation>
    </message>
    <message>
        <source>%1 · %2</source>
        <translation>%1 · %2</translation>
    </message>
    <message>
        <source>Time of the recording</source>
        <translation>Zeit der Aufnahme</translation>
    </message>
    <message>
        <source>from %1 to %2</source>
        <translation>von %1 bis %2</translation>
    </message>
    <message>
        <source>%1: %2</source>
        <translation>%1: %2</translation>
    </message>
    <message>
        <source>Pause</source>
        <translation>Pause</translation>
    </message>
    <message>
        <source>Play</source>
        <translation>Abspielen</translation>
    </message>
    <message>
        <source>Step</source>
        <translation>Schritt</translation>
    </message>
    <message>
        <source>Play the next message</source>
        <translation>Nächste Nachricht abspielen</translation>
    </message>
    <message>
        <source>Previous mark</source>
        <translation>Vorige Marke</translation>
    </message>
    <message>
        <source>Next mark</source>
        <translation>Nächste Marke</translation>
    </message>
    <message>
        <source>Speed</source>
        <translation>Tempo</translation>
    </message>
    <message>
        <source>%1 x</source>
        <translation>%1 x</translation>
    </message>
    <message>
        <source>Loop</source>
        <translation>Schleife</translation>
    </message>
    <message>
        <source>From here</source>
        <translation>Ab hier</translation>
    </message>
    <message>
        <source>Play from here on</source>
        <translation>Ab hier abspielen</translation>
    </message>
    <message>
        <source>Until here</source>
        <translation>Bis hier</translation>
    </message>
    <message>
        <source>Play until here</source>
        <translation>Bis hier abspielen</translation>
    </message>
    <message>
        <source>Whole</source>
        <translation>Ganz</translation>
    </message>
    <message>
        <source>Play the whole recording</source>
        <translation>Ganze Aufnahme abspielen</translation>
    </message>
    <message>
        <source>%1 / %2</source>
        <translation>%1 / %2</translation>
    </message>
</context>
<context>
    <name>ToastManager</name>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
</context>
<context>
    <name>TopicTree</name>
    <message>
        <source>Topics</source>
        <translation>Topics</translation>
    </message>
    <message>
        <source>%1 topics</source>
        <translation>%1 Topics</translation>
    </message>
    <message>
        <source>%1 of %2 topics</source>
        <translation>%1 von %2 Topics</translation>
    </message>
    <message>
        <source>Filter by name or type</source>
        <translation>Nach Name oder Typ filtern</translation>
    </message>
    <message>
        <source>There are no topics yet.</source>
        <translation>Es gibt noch keine Topics.</translation>
    </message>
    <message>
        <source>No topic matches the filter.</source>
        <translation>Kein Topic passt zum Filter.</translation>
    </message>
    <message>
        <source>%1, %2</source>
        <translation>%1, %2</translation>
    </message>
    <message>
        <source>%1 → %2</source>
        <translation>%1 → %2</translation>
    </message>
    <message>
        <source>1 topic</source>
        <translation>1 Topic</translation>
    </message>
    <message>
        <source>from %1</source>
        <translation>von %1</translation>
    </message>
    <message>
        <source>no publisher</source>
        <translation>kein Publisher</translation>
    </message>
    <message>
        <source>to %1</source>
        <translation>an %1</translation>
    </message>
    <message>
        <source>no subscriber</source>
        <translation>kein Subscriber</translation>
    </message>
    <message>
        <source>%1 Hz, %2/s, %3 each</source>
        <translation>%1 Hz, %2/s, je %3</translation>
    </message>
    <message>
        <source>nothing received in the last seconds</source>
        <translation>in den letzten Sekunden nichts empfangen</translation>
    </message>
</context>
<context>
    <name>TourBox</name>
    <message>
        <source>Tour</source>
        <translation>Rundgang</translation>
    </message>
    <message>
        <source>%1 of %2</source>
        <translation>%1 von %2</translation>
    </message>
    <message>
        <source>Skip</source>
        <translation>Überspringen</translation>
    </message>
    <message>
        <source>Skip the tour</source>
        <translation>Rundgang überspringen</translation>
    </message>
    <message>
        <source>Next</source>
        <translation>Weiter</translation>
    </message>
    <message>
        <source>Done</source>
        <translation>Fertig</translation>
    </message>
</context>
<context>
    <name>WhoSteers</name>
    <message>
        <source>Who steers</source>
        <translation>Wer steuert</translation>
    </message>
    <message>
        <source>another node called %1 publishes %2</source>
        <translation>ein weiterer Knoten namens %1 sendet %2</translation>
    </message>
    <message>
        <source>%1 may steer by %2</source>
        <translation>%1 kann über %2 steuern</translation>
    </message>
    <message>
        <source>%1 also publishes %2</source>
        <translation>%1 sendet ebenfalls %2</translation>
    </message>
    <message>
        <source>no node receives %1</source>
        <translation>kein Knoten empfängt %1</translation>
    </message>
    <message>
        <source>%1 steers by %2 through %3</source>
        <translation>%1 steuert über %2 durch %3</translation>
    </message>
    <message>
        <source>%1 nodes are called %2: all obey, or all steer</source>
        <translation>%1 Knoten heißen %2: alle gehorchen oder alle steuern</translation>
    </message>
    <message>
        <source>locked by %1: commands are not passed on</source>
        <translation>durch %1 gesperrt: Befehle werden nicht weitergegeben</translation>
    </message>
    <message>
        <source>lock %1: nothing received</source>
        <translation>Sperre %1: nichts empfangen</translation>
    </message>
    <message>
        <source>only this screen</source>
        <translation>nur dieser Bildschirm</translation>
    </message>
    <message>
        <source>and %1 more</source>
        <translation>und %1 weitere</translation>
    </message>
</context>
<context>
    <name>fields</name>
    <message>
        <source>the robot is not connected: Ros2.init() was not called</source>
        <translation>der Roboter ist nicht verbunden: Ros2.init() wurde nicht aufgerufen</translation>
    </message>
    <message>
        <source>the robot is not connected: %1</source>
        <translation>der Roboter ist nicht verbunden: %1</translation>
    </message>
    <message>
        <source>the robot is not connected</source>
        <translation>der Roboter ist nicht verbunden</translation>
    </message>
    <message>
        <source>it gave no reason</source>
        <translation>ohne Grund</translation>
    </message>
</context>
<context>
    <name>orientation</name>
    <message>
        <source>the IMU measures no orientation</source>
        <translation>die IMU misst keine Orientierung</translation>
    </message>
    <message>
        <source>the orientation is not a number</source>
        <translation>die Orientierung ist keine Zahl</translation>
    </message>
    <message>
        <source>the orientation is zero</source>
        <translation>die Orientierung ist null</translation>
    </message>
    <message>
        <source>the orientation has the length %1, not 1</source>
        <translation>die Orientierung hat die Länge %1 statt 1</translation>
    </message>
    <message>
        <source>convention is &quot;ENU&quot; or &quot;NED&quot;, not &quot;%1&quot;</source>
        <translation>convention ist &quot;ENU&quot; oder &quot;NED&quot;, nicht &quot;%1&quot;</translation>
    </message>
</context>
<context>
    <name>units</name>
    <message>
        <source>%1 B</source>
        <translation>%1 B</translation>
    </message>
    <message>
        <source>%1 kB</source>
        <translation>%1 kB</translation>
    </message>
    <message>
        <source>%1 MB</source>
        <translation>%1 MB</translation>
    </message>
    <message>
        <source>%1 GB</source>
        <translation>%1 GB</translation>
    </message>
</context>
</TS>
