"""What does my force model lack, and can I trust what I learned about it?"""
