// run: check {}
// A sketch for an Arduino that was given another name.
const int button = 2;
const int lamp = 13;

void setup()
{
    pinMode(button, INPUT);
    pinMode(lamp, OUTPUT);
}

void loop()
{
    if (digitalRead(button) == HIGH)
        digitalWrite(lamp, HIGH);
    else
        digitalWrite(lamp, LOW);
}
